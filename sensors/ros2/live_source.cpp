// Topics as they are discovered, a first look, then message by message.
#include <lamina/sensors/ros2/live_source.hpp>

#include <algorithm>
#include <chrono>
#include <thread>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/bag_depth.hpp>
#include <lamina/sensors/readers/bag_recording.hpp>
#include <lamina/sensors/readers/bag_roles.hpp>
#include <lamina/sensors/ros2/cdr_messages.hpp>
#include <lamina/sensors/ros2/live_look.hpp>
#include <lamina/sensors/ros2/storage.hpp>

namespace lamina::ros2 {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

struct LiveTopic {
  dds::OfferedTopic offered;
  std::string type, role;  // type as ROS 1 has it
  bool subscribed = false;
  std::int64_t looked = 0;  // messages of the first look
};

LiveOrder order_of(const std::string& role) {
  if (role == "odom") return LiveOrder::kOdometry;
  if (role == "tf") return LiveOrder::kTransforms;
  return role == "camera_info" ? LiveOrder::kDirect : LiveOrder::kStamped;
}

class Source final : public bag::LiveSource {
 public:
  Source(std::unique_ptr<dds::Wire> wire, LiveOptions options)
      : options_(std::move(options)), queue_(options_.queue), wire_(std::move(wire)) {
    take_look();
  }

  std::vector<bag::Topic> topics() const override {
    std::vector<bag::Topic> all;
    for (const LiveTopic& topic : topics_)
      all.push_back({topic.offered.name, topic.type, topic.looked, ""});
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return all;
  }
  void select(const std::vector<std::string>& names) override {
    wanted_ = wanted(names);
    next_looked_ = 0;
    waiting_.clear();
  }
  Status next(bag::Message& message) override;
  void go_live(const std::vector<std::string>& names) override;
  SkippedCounts skipped() const override;
  std::vector<Warning> warnings() const override;

 private:
  void take_look();
  void subscribe_new();
  void read_looked(std::size_t& done, LiveLook& look);
  bool look_is_over(const LiveLook& look) const;
  std::vector<bool> wanted(const std::vector<std::string>& names) const;
  std::optional<LiveMessage> looked_message();
  std::optional<LiveMessage> live_message();
  bool publishers_gone();
  Status read(const LiveMessage& received, bag::Message& message);

  LiveOptions options_;
  std::vector<LiveTopic> topics_;  // in the order of the queue's numbers
  std::vector<bool> wanted_;
  std::vector<LiveMessage> look_;
  std::size_t next_looked_ = 0;
  bool live_ = false;
  bag::DepthReader depth_;
  std::deque<bag::Message> waiting_;  // transforms of one message
  Clock::time_point began_ = Clock::now();
  std::optional<Clock::time_point> first_frame_, without_publisher_;
  LiveQueue queue_;
  std::unique_ptr<dds::Wire> wire_;  // last: its threads put into the queue
};

// Types that a role is known of. What is not mapped is listed alone.
void Source::subscribe_new() {
  for (const dds::OfferedTopic& offered : wire_->topics()) {
    const auto same = [&](const LiveTopic& t) { return t.offered.name == offered.name; };
    if (std::any_of(topics_.begin(), topics_.end(), same)) continue;
    LiveTopic topic{offered, type_of_ros1(offered.type), "", false, 0};
    topic.offered.name = printable(offered.name);
    topic.role = bag::role_of_type(topic.type);
    const bool used = !topic.role.empty() && topic.role != "stream";
    const std::size_t number = queue_.add_topic(order_of(topic.role));
    topics_.push_back(topic);
    if (!used) continue;
    dds::OfferedTopic wanted = offered;
    wanted.qos.depth = 256;  // taken as they come: a burst
    topics_[number].subscribed =
        wire_->subscribe(wanted, [this, number](std::string_view cdr) { queue_.put(number, cdr); });
  }
}

// Of images the first alone: what shows colours is not received any longer.
void Source::read_looked(std::size_t& done, LiveLook& look) {
  for (const LiveMessage& received : queue_.looked(done)) {
    ++done;
    LiveTopic& topic = topics_[received.topic];
    const bool frame = order_of(topic.role) == LiveOrder::kStamped;
    if (!topic.subscribed || (frame && look.has(topic.offered.name))) continue;
    bag::Message message;
    const Status status = read(received, message);
    if (topic.role == "image" && message.kind != bag::Kind::kDepth) {
      wire_->unsubscribe(topic.offered.name);
      topic.subscribed = false;
      continue;
    }
    for (const bag::Message& transform : waiting_) look.add(topic.role, transform);
    waiting_.clear();
    if (status == Status::kMessage) look.add(topic.role, message);
  }
  if (look.has_frames() && !first_frame_) first_frame_ = Clock::now();
}

bool Source::look_is_over(const LiveLook& look) const {
  if (options_.ended()) return true;
  if (!first_frame_) return since(began_) > options_.first;
  const double passed = since(*first_frame_);
  if (passed < options_.look) return false;
  if (passed > options_.look + options_.complete) return true;
  const bool odometry = std::all_of(topics_.begin(), topics_.end(), [&](const LiveTopic& topic) {
    return topic.role != "odom" || look.has(topic.offered.name);
  });
  return odometry && look.missing().empty();
}

void Source::take_look() {
  LiveLook look;
  for (std::size_t done = 0; !look_is_over(look);) {
    subscribe_new();
    std::this_thread::sleep_for(std::chrono::duration<double>(options_.ask));
    read_looked(done, look);
  }
  look_ = queue_.end_look();
  for (const LiveMessage& message : look_)
    if (topics_[message.topic].subscribed) ++topics_[message.topic].looked;
  std::string missing;
  for (const std::string& one : look.missing()) missing += (missing.empty() ? "" : ", ") + one;
  if (!missing.empty()) options_.say("ros2: not received: " + missing);
}

std::vector<bool> Source::wanted(const std::vector<std::string>& names) const {
  std::vector<bool> all;
  for (const LiveTopic& topic : topics_)
    all.push_back(topic.subscribed &&
                  std::find(names.begin(), names.end(), topic.offered.name) != names.end());
  return all;
}

void Source::go_live(const std::vector<std::string>& names) {
  wanted_ = wanted(names);
  std::string used;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    LiveTopic& topic = topics_[i];
    if (wanted_[i]) used += (used.empty() ? "" : ", ") + topic.offered.name;
    if (wanted_[i] || !topic.subscribed) continue;
    wire_->unsubscribe(topic.offered.name);
  }
  queue_.go_live(wanted_, std::move(look_));
  look_.clear();
  waiting_.clear();
  live_ = true;
  options_.say("ros2: maps " + used);
}

std::optional<LiveMessage> Source::looked_message() {
  while (next_looked_ < look_.size()) {
    const LiveMessage& message = look_[next_looked_++];
    if (message.topic < wanted_.size() && wanted_[message.topic]) return message;
  }
  return std::nullopt;
}

bool Source::publishers_gone() {
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (!wanted_[i] || order_of(topics_[i].role) != LiveOrder::kStamped) continue;
    if (wire_->publishers(topics_[i].offered.name) > 0) {
      without_publisher_.reset();
      return false;
    }
  }
  if (!without_publisher_) without_publisher_ = Clock::now();
  return since(*without_publisher_) > options_.gone;
}

std::optional<LiveMessage> Source::live_message() {
  while (!options_.ended()) {
    if (auto message = queue_.take(options_.ask)) return message;
    if (publishers_gone()) {
      options_.say("ros2: no publisher any more: the map ends here");
      break;
    }
  }
  return std::nullopt;
}

bag::Source::Status Source::read(const LiveMessage& received, bag::Message& message) {
  const LiveTopic& topic = topics_[received.topic];
  message = bag::Message();
  message.topic = topic.offered.name;
  message.stamp_ns = received.stamp;
  const Status status = decode(topic.type, received.bytes, depth_, message, waiting_);
  message.stamp_ns = received.stamp;  // adjusted
  for (bag::Message& transform : waiting_)
    if (live_ && transform.topic != "/tf_static")
      transform.stamp_ns =
          queue_.adjusted(topic.offered.name + " " + transform.child_frame, transform.stamp_ns);
  return status;
}

bag::Source::Status Source::next(bag::Message& message) {
  while (true) {
    if (!waiting_.empty()) {
      message = std::move(waiting_.front());
      waiting_.pop_front();
      return Status::kMessage;
    }
    const auto received = live_ ? live_message() : looked_message();
    if (!received) return Status::kEnd;
    const Status status = read(*received, message);
    if (waiting_.empty()) return status;
  }
}

SkippedCounts Source::skipped() const {
  SkippedCounts all;
  const auto dropped = queue_.dropped();
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    const std::string& name = topics_[i].offered.name;
    if (dropped[i] > 0) all["dropped: " + name] = dropped[i];
    const std::int64_t lost = topics_[i].subscribed ? wire_->lost(name) : 0;
    if (lost > 0) all["lost on the way: " + name] = lost;
  }
  return all;
}

std::vector<Warning> Source::warnings() const {
  std::vector<Warning> all;
  const auto dropped = queue_.dropped(), received = queue_.received();
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (dropped[i] == 0) continue;
    const std::string n = std::to_string(dropped[i]), of = std::to_string(received[i]);
    all.push_back({"live_dropped", n + " of " + of + " messages of " + topics_[i].offered.name +
                                       " were dropped: they came faster than they could be "
                                       "mapped; the map is of the others"});
  }
  if (const LiveClock clock = queue_.clock(); clock.steps() > 0) {
    const Timestamp first = Timestamp::from_nanoseconds(clock.first_step());
    all.push_back({"clock_set", "the robot's clock was set " + std::to_string(clock.steps()) +
                                    " times, first after " + first.to_string() +
                                    " s: times go on where they stood"});
  }
  return all;
}

}  // namespace

std::unique_ptr<bag::LiveSource> make_live_source(std::unique_ptr<dds::Wire> wire,
                                                  const LiveOptions& options) {
  return std::make_unique<Source>(std::move(wire), options);
}

}  // namespace lamina::ros2
