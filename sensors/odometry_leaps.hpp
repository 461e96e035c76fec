// Odometry whose counter is set anew on the way, as if it had counted on.
#pragma once

#include <cstddef>
#include <cstdint>
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
  double slow = 0.3;        ///< s between counts, at least, and
  std::int64_t slower = 4;  ///< samples that repeat the last count: its steps say little of the way
  double hole = 4;          ///< times the usual interval without a sample, and `longest` at least
  double near = 0.5;        ///< s: leaps this near each other are one (poses interpolated in it)
};

/// A step of the odometry that is farther than the speed before, an acceleration no robot has and
/// five times the longest step of late allow is no motion: the counter was set anew or leapt. The
/// body is taken to have gone on at its speed before, and what follows counts on from there; after
/// a hole that is not known, and the sample says so (restarted). A counter that stands at its
/// origin again after a hole was restarted in it. Poses that repeat the last one say nothing new:
/// of a counter that is read more often than it counts. Streaming: asks nothing of what comes
/// later.
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
  /// s between changes of a counter that is read far more often than it counts, while it moves; 0:
  /// it counts as it is read.
  double counts_every() const;
  /// So far, in order.
  const std::vector<Leap>& leaps() const { return leaps_; }

 private:
  struct Step {
    double way = 0, turn = 0, interval = 0;  ///< s since the counter moved; 0: interpolated
  };
  bool leapt(const SE3& moved, double time, bool to_origin) const;
  double usual_interval() const;
  /// Keeps the leap; the motion that is taken in its place.
  SE3 take_leap(const Odometry& measured, const SE3& moved, bool to_origin);

  OdometryLeapOptions options_;
  std::optional<Odometry> last_;  ///< as measured
  Timestamp changed_, counted_;   ///< of the last sample that moved; of the last recorded one
  SE3 T_first_now_;               ///< of the frame in which the counter counts now
  std::deque<Step> steps_;        ///< of late
  Vector6d velocity_ = Vector6d::Zero();
  int in_a_row_ = 0;            ///< leaps, up to now
  std::vector<double> counts_;  ///< s between changes of a counter that moves slowly, so far
  std::int64_t repeats_ = 0;    ///< recorded samples since the last count that repeat it
  std::int64_t changes_ = 0;
  std::vector<Leap> leaps_;
};

}  // namespace lamina
