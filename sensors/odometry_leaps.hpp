// Odometry whose counter is set anew on the way, as if it had counted on.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include <lamina/sensors/odometry.hpp>

namespace lamina {

struct OdometryLeapOptions {
  double acceleration = 10, spin = 20;    ///< m/s^2, rad/s^2: no robot on a floor does more
  double slack = 0.2, turn_slack = 0.15;  ///< m, rad: what a counter may be off at once (slips)
  double usual = 5;                       ///< times the longest step of late: stamps may bunch
  double longest = 1;  ///< s over which the acceleration may last: afterwards speeds are bounded
  std::size_t memory = 30;  ///< steps that count as of late
  double restart = 0.001;   ///< m, rad: a pose so near the origin may be one of a counter reset
  int most_in_a_row = 2;    ///< leaps of recorded samples: more is how this body moves
  double near = 0.5;        ///< s: leaps this near each other are one (poses interpolated in it)
};

/// A step of the odometry that is farther than the speed before, an acceleration no robot has and
/// five times the longest step of late allow is no motion: the counter was set anew or leapt. The
/// body is taken to have gone on at its speed before, and what follows counts on from there.
/// Streaming: asks nothing of what comes later.
class OdometryLeaps {
 public:
  explicit OdometryLeaps(const OdometryLeapOptions& options = {}) : options_(options) {}

  struct Leap {
    Timestamp stamp;
    double metres = 0, radians = 0;
    bool to_origin = false;  ///< the counter began at zero again
  };

  /// The sample in the frame of the first one, leaps taken out.
  Odometry add(const Odometry& measured);
  /// So far, in order.
  const std::vector<Leap>& leaps() const { return leaps_; }

 private:
  struct Step {
    double way = 0, turn = 0, dt = 0;
  };
  bool leapt(const SE3& moved, double dt, bool to_origin) const;

  OdometryLeapOptions options_;
  std::optional<Odometry> last_;  ///< as measured
  SE3 T_first_now_;               ///< of the frame in which the counter counts now
  std::deque<Step> steps_;        ///< of late
  Vector6d velocity_ = Vector6d::Zero();
  int in_a_row_ = 0;  ///< leaps, up to now
  std::vector<Leap> leaps_;
};

}  // namespace lamina
