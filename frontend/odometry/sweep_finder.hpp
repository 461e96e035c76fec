// How long a scanner's beam goes round, told by scans of the same place at different rates of turn.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <lamina/frontend/odometry/planar.hpp>
#include <lamina/frontend/odometry/scan_points.hpp>
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
    double sigma = 0;  ///< s, from groups of pairs left out in turn
  };

  /// `T_start_body`: planar pose of the body, near enough to lay scans of the last metre onto each
  /// other; `velocity` at the scan's stamp (right tangent, m/s and rad/s).
  void add(const LaserScan& scan, const PlanarPose& T_start_body, const Vector6d& velocity);
  /// False once more scans would change nothing.
  bool wants_more() const { return pairs_.size() < kMostPairs; }
  /// Pairs gathered so far.
  std::size_t pairs() const { return pairs_.size(); }
  /// nullopt where the sweep is not five sigmas and 10 ms from zero, or scans were too few.
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
    Vector6d velocity;
    double turn_rate() const { return velocity(5); }
    template <class A>
    friend void fields(A& a, Shot& v) {
      a(v.scan, v.T_start_body, v.velocity);
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

  double cost(const Pair& pair, double sweep) const;
  double cost(double sweep, std::size_t every = 1) const;  ///< of every so many pairs
  Pull pull(const Pair& pair, double sweep) const;
  double coarse(double longest) const;

  std::vector<Shot> near_;  ///< of the last metre
  std::vector<Pair> pairs_;
  std::optional<PlanarPose> last_pair_;
  std::optional<Timestamp> last_stamp_;
  std::vector<double> intervals_;  ///< s, between scans, of the first ones
};

}  // namespace lamina
