// How long a scanner's beam goes round, told by scans of the same place at different rates of turn.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>
#include <lamina/frontend/motion/scan_points.hpp>
#include <lamina/models/adoption.hpp>
#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// A beam that takes `sweep` seconds to go round smears a scan by sweep times the turn rate. Two
/// scans of one place, one turning and one not (or the other way), fit each other only when both
/// are straightened by the right sweep. Gathers such pairs and looks for the sweep, of either order
/// of the beams, with which they all fit best: from the best of a few (mean square truncated at
/// 5 cm) by Gauss-Newton on distances of points from lines, each pair's relative pose eliminated.
/// Turning at a constant rate alone tells nothing.
class SweepFinder {
 public:
  struct Found {
    double sweep = 0;  ///< s from a scan's first beam to its last; negative: the last comes first
    double sigma = 0;  ///< s, from blocks of pairs left out in turn
    Adoption adoption;
  };

  /// `T_start_body`: planar pose of the body, near enough to lay scans of the last metre onto each
  /// other; `velocity` at the scan's stamp (right tangent, m/s and rad/s) and how it changes.
  void add(const LaserScan& scan, const PlanarPose& T_start_body, const Vector6d& velocity,
           const Vector6d& acceleration = Vector6d::Zero());
  /// False once more scans would change nothing.
  bool wants_more() const { return pairs_.size() < kMostPairs; }
  /// Pairs gathered so far.
  std::size_t pairs() const { return pairs_.size(); }
  /// nullopt where scans were too few, or the best sweep is below 10 ms. Whether it is more than
  /// chance its `adoption` says.
  std::optional<Found> found() const;

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, SweepFinder& v) {
    a(v.near_, v.pairs_, v.last_pair_, v.last_stamp_, v.intervals_);
  }

 private:
  struct Shot {
    LaserScan scan;
    PlanarPose T_start_body;
    Vector6d velocity, acceleration;
    double turn_rate() const { return velocity(5); }
    /// The mean over the time from the stamp to the last beam.
    Vector6d mean_velocity(double sweep) const { return velocity + sweep / 2 * acceleration; }
    template <class A>
    friend void fields(A& a, Shot& v) {
      a(v.scan, v.T_start_body, v.velocity, v.acceleration);
    }
  };
  struct Pair {
    Shot still, turning;  ///< by their turn rates' difference
    template <class A>
    friend void fields(A& a, Pair& v) {
      a(v.still, v.turning);
    }
  };
  /// What one pair or several say at a sweep: d = gradient / information brings them closest.
  struct Pull {
    double information = 0, gradient = 0;  ///< the pair's relative pose eliminated
    Pull& operator+=(const Pull& other) {
      information += other.information;
      gradient += other.gradient;
      return *this;
    }
  };
  static constexpr std::size_t kMostPairs = 200;

  /// The turning scan laid on the still one as well as they go, both straightened by a sweep.
  struct Laid;
  static Laid lay(const Pair& pair, double sweep);
  /// Of the turning scan's oriented points from their partners; 1000 for those that have none.
  static std::vector<double> misfits(const Laid& laid);  ///< in sigmas
  Adoption judge(double sweep, const std::vector<double>& left_out) const;
  static double cost(const Pair& pair, double sweep);
  double cost(double sweep, std::size_t every = 1) const;  ///< of every so many pairs
  static Pull pull(const Pair& pair, double sweep);
  double coarse(double longest) const;

  std::vector<Shot> near_;  ///< of the last metre
  std::vector<Pair> pairs_;
  std::optional<PlanarPose> last_pair_;
  std::optional<Timestamp> last_stamp_;
  std::vector<double> intervals_;  ///< s, between scans, of the first ones
};

}  // namespace lamina
