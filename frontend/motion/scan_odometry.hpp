// Motion of a robot on a floor from its 2D scans: scan to local map, helped by wheels if any.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include <lamina/frontend/motion/likelihood_grid.hpp>
#include <lamina/frontend/motion/line_matcher.hpp>
#include <lamina/frontend/motion/match_quality.hpp>
#include <lamina/frontend/motion/motion_limits.hpp>
#include <lamina/frontend/motion/observability.hpp>
#include <lamina/frontend/motion/scan_points.hpp>
#include <lamina/frontend/motion/slip_detector.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

struct ScanOdometryOptions {
  ScanPointOptions points;
  LineMatchOptions match;
  double key_translation = 0.3;  ///< m moved since the last key scan: a new one
  double key_rotation = 0.25;    ///< rad turned, likewise
  double key_matched = 0.7;      ///< or when less than this of the scan is in the local map
  int key_scans = 24;            ///< in the local map: longer drifts less, shorter forgets bends
  double map_radius = 25;        ///< m; key scans farther away leave the local map
  double thin_cell = 0.02;       ///< m; scan points nearer together than this add nothing
  double check_matched = 0.75;   ///< below: try constant velocity as the start, too
  double min_matched = 0.55;     ///< below: search around before believing the match
  double lost_matched = 0.3;     ///< below, after the search: lost, wheels alone count
  /// A match that is farther from the wheels' motion than this (3 dof) and finds less of the scan
  /// than `sure_matched` is searched for, too.
  double contradiction_chi_squared = 100, sure_matched = 0.9;
  /// A match that contradicts the wheels like that and breaks these limits is rejected, as is
  /// one that explains the scan for no less than slipping costs.
  MotionLimits limits;
  /// Intervals longer or shorter than the last one by this factor say nothing of its speed.
  double alike = 2.5;
  /// Wheels' word counts for less the more sigmas scans contradict it by (PlanarPrior::robust).
  bool robust_wheels = true;
  /// Scans are asked by themselves where wheels seem to slip (SlipDetector).
  bool downweight_wheels = true;
  double search_translation = 0.5;  ///< m, least window of that search
  double search_rotation = 0.35;    ///< rad, likewise
  double search_resolution = 0.05;  ///< m a cell
  double max_tilt = 0.5;  ///< rad between scanner and body plane; beyond, scans say nothing
  /// What a match is off at best, added to its covariance: m, rad, and per m or rad of motion.
  double sigma_translation = 0.0005, sigma_rotation = 0.0002, sigma_motion = 0.01;
  double sigma_lever = 0.03;  ///< m: the scanner may sit off its stated place by this
  /// Constant velocity where there are no wheels: m and rad per step, 1-sigma.
  double sigma_velocity = 0.2, sigma_turn = 0.3;
  /// s between scans beyond which a body without wheels turns further than a match finds back from.
  double slow_alone = 0.12;
  /// Share of a scan's points that lie in a bearing of which a key scan holds something; below, it
  /// shows another side of the place, and what does not fit is no loss.
  double looked = 0.5;
  /// rad, rms: normals along one straight wall scatter by that. Without wheels the way along it is
  /// open.
  double scatter_of_normals = 0.2;
  /// Height (m), roll and pitch (rad) that a step on a floor may change, 1-sigma, without wheels.
  double sigma_height = 0.002, sigma_level = 0.001;
};

/// What the wheels say between two scans.
struct MotionGuess {
  SE3 T_prev_curr_body;
  Matrix6d covariance = Matrix6d::Identity();  ///< right tangent (translation, rotation)
};

struct ScanMotion {
  enum class Status {
    kFirst,       ///< no motion yet: identity
    kTracked,     ///< the scan held all three directions
    kDegenerate,  ///< it did not (a corridor): those are from the wheels or constant velocity
    kPredicted,   ///< the scan said nothing: wheels or constant velocity alone
  };
  SE3 T_prev_curr_body;
  Matrix6d covariance = Matrix6d::Zero();  ///< right tangent (translation, rotation)
  /// The motion less what the wheels had a say in; only where this scan and the one before were
  /// tracked. Noisier, and the one to compare wheels with.
  std::optional<SE3> by_scans_alone;
  Status status = Status::kFirst;
  int unknown_directions = 0;   ///< of x, y, yaw, that the scan left open
  double matched = 0;           ///< fraction of scan points found in the local map
  bool searched = false;        ///< a correlative search was needed
  bool wheels_slipped = false;  ///< the scan by itself was believed over them (SlipDetector)
  bool wheels_went_on = false;  ///< as before, where one scan said nothing: nobody carried the body
  int iterations = 0;
  LeftToWheels left_to_wheels;  ///< where these were asked
};

/// Aligns each scan with a map of the last key scans by match_lines(); when too little of it fits,
/// search_correlative() looks around: near where the robot was expected, then as far as it can have
/// come. Wheel odometry is the start and a prior by its own covariance, so that it decides only
/// what the scan leaves open. Motion is planar in the body's x-y plane whatever the scanner's
/// mounting up to max_tilt. Without wheels, a scan after a long gap that fits worse than usual is
/// not believed (UsualFit). Deterministic.
class ScanOdometry {
 public:
  explicit ScanOdometry(const ScanOdometryOptions& options = {});
  const ScanOdometryOptions& options() const { return options_; }
  /// `slopes`: the ground changes its slope hereabouts. Returns from it go along with the body, or
  /// ahead of it: wheels are not doubted.
  ScanMotion process(const LaserScan& scan, const std::optional<MotionGuess>& wheels = {},
                     bool slopes = false);

  /// Points of the last scan in the body's plane, as they were matched.
  const std::vector<OrientedPoint>& last_points() const { return points_; }

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, ScanOdometry& v) {
    a(v.points_, v.T_local_body_, v.T_local_alone_, v.velocity_, v.key_scans_, v.map_, v.usual_,
      v.last_stamp_, v.last_interval_, v.observed_, v.slip_detector_);
    if constexpr (A::kReading) v.grid_.reset();  // made anew from the map when it is needed
  }

 private:
  struct KeyScan {
    PlanarPose T_local_body;
    std::vector<OrientedPoint> points;  ///< in the local frame
    template <class A>
    friend void fields(A& a, KeyScan& v) {
      a(v.T_local_body, v.points);
    }
  };
  struct Prediction {
    PlanarPose T_prev_curr;
    Eigen::Matrix3d covariance;
  };
  Prediction predict(const std::optional<MotionGuess>& wheels) const;
  /// The motion since the last scan, had it gone on as between the two before.
  struct GoingOn {
    double dt = 0;  ///< s since the last scan; 0: unknown, or unlike the interval before
    PlanarPose motion;
    bool even = false;  ///< the two intervals are the same to a fifth
  };
  LineMatch align(const Prediction& prediction, bool wheels, const GoingOn& before,
                  const Eigen::Vector2d& scanner, ScanMotion& motion);
  void hold_to_wheels(const PlanarPrior& wheels, const Prediction& prediction,
                      const GoingOn& before, LineMatch& match) const;
  /// The match without what came where the key scans saw through, where that explains why scan and
  /// wheels differ; points_ without it, then.
  void check_match(const PlanarPrior& wheels, const Prediction& prediction,
                   const Eigen::Vector2d& scanner, LineMatch& match);
  /// Chi-squared of 3 degrees of freedom.
  double contradiction(const LineMatch& match, const Prediction& prediction) const;
  LineMatch reconciled(const PlanarPrior& wheels, const LineMatch& found) const;
  /// `wheels`: null where there are none.
  LineMatch search_near(const Prediction& prediction, const PlanarPrior* wheels,
                        const LineMatch& best);
  LineMatch search_far(const Prediction& prediction, const PlanarPrior* wheels,
                       const LineMatch& best);
  LineMatch search(const PlanarPose& start, const SearchWindow& window);
  void fill(const Prediction& prediction, const LineMatch& match,
            const std::optional<MotionGuess>& wheels, bool doubtful, ScanMotion& motion) const;
  std::optional<PlanarPose> alone(const Prediction& prediction, const LineMatch& match) const;
  /// Whether wheels say that the body, `dt` s after the last scan, drives as it did before that.
  bool wheels_go_on(const MotionGuess& wheels, double dt, double interval_before) const;
  void keep_key_scan(const LineMatch& match, bool lost);
  /// Tells slip_detector_ how far a match (lost: none) and the wheels differ along the latter's
  /// way.
  void compare(const std::optional<MotionGuess>& wheels, const LineMatch& match, bool lost);

  ScanOdometryOptions options_;
  std::vector<OrientedPoint> points_;
  PlanarPose T_local_body_, velocity_;
  std::optional<PlanarPose> T_local_alone_;  // of the last scan, by scans alone
  std::deque<KeyScan> key_scans_;
  PointMap map_;
  UsualFit usual_;
  SlipDetector slip_detector_;
  std::optional<Timestamp> last_stamp_;
  double last_interval_ = 0;            ///< s
  bool observed_ = false;               ///< the last scan told something of its motion
  std::optional<LikelihoodGrid> grid_;  ///< of map_, made when first needed
};

template <class A>
void fields(A& a, ScanMotion& v) {
  a(v.T_prev_curr_body, v.covariance, v.by_scans_alone, v.status, v.unknown_directions, v.matched,
    v.searched, v.wheels_slipped, v.wheels_went_on, v.iterations, v.left_to_wheels);
}

}  // namespace lamina
