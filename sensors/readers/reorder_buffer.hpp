// Puts nearly ordered measurements into order while they stream by.
#pragma once

#include <deque>
#include <optional>

#include <lamina/sensors/measurement.hpp>

namespace lamina {

/// Holds measurements back until what was pushed is `horizon` seconds newer, or `capacity` are
/// held; gives the oldest first, of one time accelerometer, odometry, scans, then images and
/// clouds. One that is older than what was already given is refused.
class ReorderBuffer {
 public:
  explicit ReorderBuffer(double horizon = 0.5, std::size_t capacity = 64)
      : horizon_(horizon), capacity_(capacity) {}
  /// False when time goes back behind what was given out.
  bool push(Measurement measurement);
  /// The oldest when it is safe to give, or at all once `finish` was called.
  std::optional<Measurement> pop();
  void finish() { finished_ = true; }

 private:
  double horizon_;
  std::size_t capacity_;
  bool finished_ = false;
  std::deque<Measurement> held_;  // in order
  std::optional<Timestamp> newest_, given_;
};

}  // namespace lamina
