// By how much a sensor's clock is off the odometry's, told by turns that begin and end.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <lamina/pipeline/calibration/turn_track.hpp>

namespace lamina {

/// Gathers how far the body turned between instants of a sensor, as the sensor alone has it. With a
/// measurement stamped t taken at t + d by the odometry's clock, and turns of the odometry short by
/// s, a piece from a to b with the odometry's heading W has
///   yaw = (1 + s) (W(b + d) - W(a + d)):
/// d is told where the turn rate at b is another than at a. Of d from -0.25 to 0.25 s the one of
/// least sum of absolute residuals, then Gauss-Newton over d and s with Cauchy's weights.
class ClockOffset {
 public:
  struct Result {
    double value = 0;  ///< d, s: to be added to stamps
    /// By how the residuals of stretches of 4 s pull (clusters: neither noise of one piece that
    /// comes back in the next nor a slip of seconds makes it sure), and not less than the
    /// residuals' spread gives, nor than what rates by the sensor alone as instruments make of it:
    /// those of noisy wheels pass for information.
    double sigma = 0;
    /// Stretches that tell it, counted by their information: (sum h)^2 / sum h^2.
    double stretches = 0;

    /// By five sigmas (with 2.5 ms of the odometry's own stamps: 12.5 ms at least), and told by
    /// three stretches.
    bool is_significant() const;
  };

  /// The body turned by `yaw` (rad) from one stamp of the sensor to the next; `sigma` (rad) of it.
  void add(Timestamp from, Timestamp to, double yaw, double sigma = 0.001);
  std::size_t pieces() const { return pieces_.size(); }
  /// nullopt where fewer than 20 pieces turn within the track, or the best is the end of the range.
  std::optional<Result> result(const TurnTrack& odometry) const;

  static constexpr double kRange = 0.25;  ///< s

 private:
  struct Piece {
    Timestamp from, to;
    double yaw, sigma;
  };
  class Fit;
  std::vector<Piece> pieces_;
};

}  // namespace lamina
