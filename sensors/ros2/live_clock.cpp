// Epochs of a clock, each with its offset.
#include <lamina/sensors/ros2/live_clock.hpp>

#include <algorithm>

namespace lamina::ros2 {
namespace {
std::int64_t nanoseconds(double seconds) { return static_cast<std::int64_t>(1e9 * seconds); }
}  // namespace

bool LiveClock::was_set(const Stream& stream, std::int64_t stamp, std::int64_t arrival) const {
  const double passed = 1e-9 * static_cast<double>(arrival - stream.arrival);
  return stamp < stream.stamp - nanoseconds(options_.back) ||
         stamp > stream.stamp + nanoseconds(options_.ahead + options_.fastest * passed);
}

std::int64_t LiveClock::adjusted(const std::string& name, std::int64_t stamp,
                                 std::int64_t arrival) {
  const auto [place, first] =
      streams_.try_emplace(name, Stream{stamp, arrival, offsets_.size() - 1});
  Stream& stream = place->second;
  if (!first && was_set(stream, stamp, arrival)) {
    if (++stream.epoch == offsets_.size()) {
      if (offsets_.size() == 1) first_step_ = newest_;
      offsets_.push_back(newest_ + nanoseconds(options_.step) - stamp);
    }
    stream.stamp = stamp;
  }
  stream.stamp = std::max(stream.stamp, stamp);
  stream.arrival = arrival;
  const std::int64_t used = stamp + offsets_[stream.epoch];
  newest_ = std::max(newest_, used);
  return used;
}

}  // namespace lamina::ros2
