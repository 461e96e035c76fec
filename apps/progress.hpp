// A progress bar on a terminal, plain lines elsewhere. On stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace lamina::apps {

class Progress {
 public:
  /// `total` measurements, where the recording can tell; `quiet` prints nothing.
  Progress(std::optional<std::int64_t> total, bool quiet);
  /// Call once a measurement: redraws at most ten times a second, or a line every five seconds.
  void update(std::int64_t done, std::int64_t planes);
  /// Ends the line.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::optional<std::int64_t> total_;
  bool quiet_, terminal_;
  Clock::time_point start_ = Clock::now(), last_ = start_;
  bool drawn_ = false;
};

}  // namespace lamina::apps
