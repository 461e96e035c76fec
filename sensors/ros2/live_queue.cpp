// Queues by topic, merged by stamp.
#include <lamina/sensors/ros2/live_queue.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace lamina::ros2 {
namespace {

std::int64_t steady_now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::int64_t wall_now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

double seconds(std::int64_t nanoseconds) { return 1e-9 * static_cast<double>(nanoseconds); }

}  // namespace

std::optional<std::int64_t> header_stamp(std::string_view cdr, bool transforms) {
  const std::size_t at = transforms ? 8 : 4;
  if (cdr.size() < at + 8) return std::nullopt;
  const bool little = cdr[1] != 0;
  const auto number = [&](std::size_t from) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto byte = static_cast<unsigned char>(cdr[from + (little ? 3 - i : i)]);
      value = value << 8 | byte;
    }
    return value;
  };
  const auto whole = static_cast<std::int32_t>(number(at));
  const std::int64_t part = number(at + 4);
  if (whole == 0 && part == 0) return std::nullopt;
  return std::int64_t{1000000000} * whole + part;
}

std::size_t LiveQueue::add_topic(LiveOrder order) {
  const std::lock_guard lock(mutex_);
  Topic& topic = topics_.emplace_back();
  topic.order = order;
  topic.name = std::to_string(topics_.size());
  topic.least = order == LiveOrder::kStamped ? options_.most : options_.most_small;
  topic.most = topic.least;
  return topics_.size() - 1;
}

// A tf message is of several publishers: no clock can be followed by it.
std::int64_t LiveQueue::stamp_of(Topic& topic, std::string_view bytes, std::int64_t now) {
  const bool transforms = topic.order == LiveOrder::kTransforms;
  const std::int64_t stamp = header_stamp(bytes, transforms).value_or(wall_now());
  if (transforms) return stamp + clock_.offset();
  return topic.order == LiveOrder::kDirect ? stamp : clock_.adjusted(topic.name, stamp, now);
}

// A first period may be any other's multiple: it deviates by a part of itself until more are known.
void LiveQueue::note_period(Topic& topic, std::int64_t stamp) {
  const auto passed = static_cast<double>(stamp - topic.newest);
  if (topic.period == 0) {
    topic.period = passed;
    topic.jitter = 0.25 * passed;
  }
  topic.jitter = 0.9 * topic.jitter + 0.1 * std::abs(passed - topic.period);
  topic.period = 0.9 * topic.period + 0.1 * passed;
}

void LiveQueue::put(std::size_t number, std::string_view bytes) {
  {
    const std::lock_guard lock(mutex_);
    Topic& topic = topics_[number];
    if (!topic.wanted) return;
    const std::int64_t now = steady_now(), stamp = stamp_of(topic, bytes, now);
    if (topic.received++ > 0 && stamp > topic.newest) note_period(topic, stamp);
    topic.newest = std::max(topic.newest, stamp);
    topic.arrival = now;
    LiveMessage message{number, stamp, now, std::string(bytes)};
    if (phase_ == Phase::kLook) {
      if (look_bytes_ + bytes.size() > options_.look_bytes) {
        ++topic.dropped;
        return;
      }
      look_bytes_ += bytes.size();
      look_.push_back(std::move(message));
      return;
    }
    const bool stamped = topic.order == LiveOrder::kStamped;
    if (topic.waiting.size() >= topic.most) {
      topic.waiting.pop_front();
      ++topic.dropped;
    }
    auto place = topic.waiting.end();
    while (stamped && place != topic.waiting.begin() && std::prev(place)->stamp > stamp) --place;
    topic.waiting.insert(place, std::move(message));
  }
  news_.notify_one();
}

std::vector<LiveMessage> LiveQueue::looked(std::size_t k) const {
  const std::lock_guard lock(mutex_);
  return {look_.begin() + static_cast<std::ptrdiff_t>(std::min(k, look_.size())), look_.end()};
}

std::vector<LiveMessage> LiveQueue::end_look() {
  const std::lock_guard lock(mutex_);
  phase_ = Phase::kBetween;
  return std::exchange(look_, {});
}

void LiveQueue::go_live(const std::vector<bool>& wanted, std::vector<LiveMessage> look) {
  const std::lock_guard lock(mutex_);
  phase_ = Phase::kLive;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    topics_[i].wanted = i < wanted.size() && wanted[i];
    if (!topics_[i].wanted) topics_[i].waiting.clear();
  }
  for (auto message = look.rbegin(); message != look.rend(); ++message) {
    Topic& topic = topics_[message->topic];
    if (!topic.wanted || topic.order != LiveOrder::kStamped) continue;
    topic.waiting.push_front(std::move(*message));
    ++topic.most;
  }
  for (Topic& topic : topics_)
    if (topic.order == LiveOrder::kStamped)
      std::stable_sort(
          topic.waiting.begin(), topic.waiting.end(),
          [](const LiveMessage& a, const LiveMessage& b) { return a.stamp < b.stamp; });
}

// Nothing older is to come of any other topic, or it was waited for long enough.
bool LiveQueue::may_go(const LiveMessage& message, std::int64_t now) const {
  if (seconds(now - message.arrival) > options_.hold) return true;
  return std::all_of(topics_.begin(), topics_.end(), [&](const Topic& topic) {
    const bool frames = topic.order == LiveOrder::kStamped;
    if (!topic.wanted || topic.order == LiveOrder::kDirect || topic.newest >= message.stamp)
      return true;
    const double silence =
        std::max(options_.silent, seconds(static_cast<std::int64_t>(5 * topic.period)));
    if (topic.received == 0 || seconds(now - topic.arrival) > silence) return true;
    return frames && static_cast<double>(message.stamp - topic.newest) <
                         options_.due * topic.period - options_.jitters * topic.jitter;
  });
}

std::optional<LiveMessage> LiveQueue::pop(std::int64_t now) {
  Topic* next = nullptr;
  for (Topic& topic : topics_) {
    if (topic.waiting.empty()) continue;
    if (topic.order != LiveOrder::kStamped) {
      next = &topic;
      break;
    }
    if (next == nullptr || topic.waiting.front().stamp < next->waiting.front().stamp) next = &topic;
  }
  if (next == nullptr) return std::nullopt;
  if (next->order == LiveOrder::kStamped && !may_go(next->waiting.front(), now))
    return std::nullopt;
  LiveMessage message = std::move(next->waiting.front());
  next->waiting.pop_front();
  next->most = std::max(next->least, next->most - 1);
  return message;
}

std::optional<LiveMessage> LiveQueue::take(double longest) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(longest);
  const auto again = std::chrono::milliseconds(5);  // holds run out
  std::unique_lock lock(mutex_);
  while (phase_ == Phase::kLive) {
    if (auto message = pop(steady_now())) return message;
    if (std::chrono::steady_clock::now() >= until) break;
    news_.wait_for(lock, again);
  }
  return std::nullopt;
}

std::vector<std::int64_t> LiveQueue::received() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::int64_t> all;
  for (const Topic& topic : topics_) all.push_back(topic.received);
  return all;
}

std::vector<std::int64_t> LiveQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::int64_t> all;
  for (const Topic& topic : topics_) all.push_back(topic.dropped);
  return all;
}

std::int64_t LiveQueue::adjusted(const std::string& stream, std::int64_t stamp) {
  const std::lock_guard lock(mutex_);
  return clock_.adjusted(stream, stamp, steady_now());
}

LiveClock LiveQueue::clock() const {
  const std::lock_guard lock(mutex_);
  return clock_;
}

}  // namespace lamina::ros2
