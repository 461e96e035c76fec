// One time line for stamps that arrive from a running robot.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace lamina::ros2 {

struct LiveClockOptions {
  double back = 0.5;    ///< s that a stream's stamps may go back without its clock being set
  double ahead = 10;    ///< s, and
  double fastest = 20;  ///< times the time that passed: further ahead, the clock was set
  double step = 0.05;   ///< s from the newest stamp to the first after the clock was set back
};

/// Stamps of streams whose common clock is set while they run go on where they stood. Each stream
/// meets the steps of the clock in the same order, at its own time.
class LiveClock {
 public:
  explicit LiveClock(const LiveClockOptions& options = {}) : options_(options) {}

  /// A stamp (ns) of a stream that arrived at `arrival` (ns, of a clock that is never set), on the
  /// time line of the first stamp.
  std::int64_t adjusted(const std::string& stream, std::int64_t stamp, std::int64_t arrival);
  /// What the newest stamps have been moved by, ns.
  std::int64_t offset() const { return offsets_.back(); }
  /// How often the clock was set.
  std::size_t steps() const { return offsets_.size() - 1; }
  /// Newest stamp (ns) before the first step.
  std::int64_t first_step() const { return first_step_; }

 private:
  struct Stream {
    std::int64_t stamp = 0, arrival = 0;  // of the newest
    std::size_t epoch = 0;                // steps met
  };
  bool was_set(const Stream& stream, std::int64_t stamp, std::int64_t arrival) const;

  LiveClockOptions options_;
  std::vector<std::int64_t> offsets_{0};
  std::map<std::string, Stream> streams_;
  std::int64_t newest_ = 0, first_step_ = 0;
};

}  // namespace lamina::ros2
