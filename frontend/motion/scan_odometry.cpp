// Scan to local map: predict, align, report, keep key scans.
#include <lamina/frontend/motion/scan_odometry.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include <lamina/frontend/motion/seen_through.hpp>

namespace lamina {
namespace {

Eigen::Vector3d squares(double xy, double yaw) { return {xy * xy, xy * xy, yaw * yaw}; }

template <class KeyScans>
PointMap map_of(const KeyScans& key_scans) {
  std::vector<OrientedPoint> all;
  for (const auto& key : key_scans) {
    for (const OrientedPoint& p : key.points) {
      if (p.oriented()) all.push_back(p);
    }
  }
  return PointMap(std::move(all));
}

// A scan that shows what no key scan did (another scanner's first, a narrow one's in a turn) finds
// nothing there: that is no loss.
template <class KeyScans>
bool shows_elsewhere(const KeyScans& key_scans, const std::vector<OrientedPoint>& points,
                     const PlanarPose& T_local_body, double looked) {
  if (key_scans.empty() || points.empty()) return false;
  std::vector<SightFan> fans;
  for (const auto& key : key_scans) {
    const auto points_body = transformed(key.points, key.T_local_body.inverse());
    fans.push_back(sight_fan(points_body, Eigen::Vector2d::Zero(), key.T_local_body));
  }
  return looked_at(points, fans, T_local_body) < looked;
}

// All walls in sight face one way, but for what normals scatter by: along them nothing is measured.
bool one_wall(const std::vector<OrientedPoint>& points, double scatter) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (const OrientedPoint& p : points) sum += p.normal * p.normal.transpose();
  const double half = 0.5 * sum.trace();
  const double least = half - std::sqrt(std::max(0.0, half * half - sum.determinant()));
  return half > 0 && least < scatter * scatter * sum.trace();
}

// Only a clearly better fit overrules the motion that was expected.
const LineMatch& better(const LineMatch& expected, const LineMatch& found) {
  return found.matched > expected.matched + 0.1 ? found : expected;
}

// Does the scan by itself, `alone`, say clearly, and by more than what one person shows of himself,
// that it was taken elsewhere than where it and the wheels agree on, `both`?
bool tells_otherwise(const LineMatch& alone, const LineMatch& both,
                     const std::vector<OrientedPoint>& points, const PlanarPose& by_wheels) {
  constexpr double kClear = 9;      // sigmas squared
  constexpr double kAsMuch = 0.02;  // of the scan
  constexpr double kFacing = 0.7;   // cosine
  constexpr double kPerson = 1;     // m
  if (!alone.converged || alone.unknown_directions > 0 || alone.matched < both.matched - kAsMuch) {
    return false;
  }
  const PlanarPose off = both.T_map_scan.inverse() * alone.T_map_scan;
  const Eigen::Vector3d e(off.x, off.y, off.yaw);
  if (e.dot(alone.information * e) < kClear) return false;
  const Eigen::Vector2d ahead =
      (by_wheels.rotation().transpose() * by_wheels.translation()).normalized();
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
  for (const OrientedPoint& p : points) {
    if (!p.oriented() || std::abs(p.normal.dot(ahead)) < kFacing) continue;
    low = low.cwiseMin(p.point);
    high = high.cwiseMax(p.point);
  }
  return (high - low).maxCoeff() > kPerson;
}

// Whether the scan by itself tells where it was taken otherwise than it and the wheels together:
// then it is the match.
bool replaced_by_scan_alone(const LineMatch& alone, const std::vector<OrientedPoint>& points,
                            const PlanarPose& by_wheels, LineMatch& match) {
  if (!tells_otherwise(alone, match, points, by_wheels)) return false;
  match = alone;
  match.prior_weight = 0;
  return true;
}

// `dt` s after a step that took `last_interval` s; of nothing where the two are unlike.
template <class GoingOn>
GoingOn constant_velocity(double dt, double last_interval, const PlanarPose& step, double alike) {
  if (!(dt > 0 && dt < alike * last_interval && last_interval < alike * dt)) return {};
  const double share = dt / last_interval;
  return {dt,
          {share * step.x, share * step.y, share * step.yaw},
          std::abs(dt - last_interval) < 0.2 * dt};
}

// Chi-squared of 3 degrees of freedom, 1 %: wheels say more than their noise. A scan that is the
// last one to the bit, while they drive, was not taken where they are.
constexpr double kClear = 11.3;

// Nothing from a scanner that does not lie in the body's plane.
std::vector<OrientedPoint> points_in_plane(const LaserScan& scan,
                                           const ScanOdometryOptions& options) {
  const Eigen::Vector3d z_body = scan.lidar.T_body_lidar.so3() * Eigen::Vector3d::UnitZ();
  if (!(std::abs(z_body.z()) >= std::cos(options.max_tilt))) return {};
  return thinned(oriented_points(scan, options.points), options.thin_cell);
}

}  // namespace

ScanOdometry::ScanOdometry(const ScanOdometryOptions& options) : options_(options) {}

ScanMotion ScanOdometry::process(const LaserScan& scan, const std::optional<MotionGuess>& wheels,
                                 bool slopes) {
  points_ = points_in_plane(scan, options_);
  const bool frozen = usual_.repeated(scan.ranges);
  ScanMotion motion;
  if (key_scans_.empty() && !wheels) {
    if (!points_.empty()) usual_.began(scan.stamp);
    keep_key_scan({}, true);
    return motion;
  }
  const double dt = last_stamp_ ? scan.stamp - *last_stamp_ : 0;
  const auto going_on = constant_velocity<GoingOn>(dt, last_interval_, velocity_, options_.alike);
  const bool go_on = wheels && observed_ && wheels_go_on(*wheels, dt, last_interval_);
  last_stamp_ = scan.stamp;
  last_interval_ = dt;
  const Prediction prediction = predict(wheels);
  const bool stale = frozen && wheels && contradiction({T_local_body_}, prediction) > kClear;
  if (stale) points_.clear();
  const Eigen::Vector2d scanner = scan.lidar.T_body_lidar.translation().head<2>();
  LineMatch match = align(prediction, wheels.has_value(), going_on, scanner, motion);
  const bool elsewhere =
      match.matched < options_.lost_matched &&
      shows_elsewhere(key_scans_, points_, T_local_body_ * prediction.T_prev_curr, options_.looked);
  if (options_.downweight_wheels)
    compare(wheels, match, match.matched < options_.lost_matched || slopes);
  if (!wheels && match.unknown_directions == 0 && one_wall(points_, options_.scatter_of_normals))
    match.unknown_directions = 1;
  if (slip_detector_.slips()) {
    const LineMatch alone =
        match_lines(map_, points_, T_local_body_ * velocity_, {}, options_.match);
    const PlanarPose by_wheels = planar_part(wheels->T_prev_curr_body);
    motion.wheels_slipped = replaced_by_scan_alone(alone, points_, by_wheels, match);
  }
  const bool doubtful = !wheels && usual_.gap_before(scan.stamp) && usual_.worse(match.matched);
  fill(prediction, match, wheels, doubtful, motion);
  const bool lost = motion.status == ScanMotion::Status::kPredicted;
  motion.wheels_went_on = lost && (go_on || stale || (elsewhere && wheels));
  const bool outlier = motion.wheels_went_on && !elsewhere;
  if (outlier) match.iterations = motion.iterations = 0;
  observed_ = !lost || (outlier && !usual_.gap_before(scan.stamp));
  if (!lost && !frozen) {
    usual_.tracked(scan.stamp, motion.matched);
  } else if (lost && !outlier && !points_.empty()) {
    usual_.began(scan.stamp);
  }
  const std::optional<PlanarPose> before = std::exchange(T_local_alone_, std::nullopt);
  if (motion.status == ScanMotion::Status::kTracked) T_local_alone_ = alone(prediction, match);
  if (before && T_local_alone_) motion.by_scans_alone = lifted(before->inverse() * *T_local_alone_);
  const PlanarPose step = planar_part(motion.T_prev_curr_body);
  T_local_body_ = T_local_body_ * step;
  velocity_ = step;
  if (!(lost && elsewhere)) {
    keep_key_scan(match, lost && !outlier);
    return motion;
  }
  key_scans_.push_back({T_local_body_, transformed(points_, T_local_body_)});
  map_ = map_of(key_scans_);
  grid_.reset();
  return motion;
}

ScanOdometry::Prediction ScanOdometry::predict(const std::optional<MotionGuess>& wheels) const {
  if (wheels) {
    // A standstill may come with a covariance of zero: nothing is that sure.
    const Eigen::Matrix3d least =
        squares(options_.sigma_translation, options_.sigma_rotation).asDiagonal();
    const PlanarPose T_prev_curr = planar_part(wheels->T_prev_curr_body);
    // A scanner that sits elsewhere than it is said to is carried along by turns.
    const Eigen::Matrix3d lever = squares(options_.sigma_lever * T_prev_curr.yaw, 0).asDiagonal();
    return {T_prev_curr, planar_block(wheels->covariance) + least + lever};
  }
  // A body that was tracked goes on but for what accelerations make of it in the time.
  double sigma = options_.sigma_velocity, sigma_turn = options_.sigma_turn;
  if (observed_ && last_interval_ > 0) {
    const MotionLimits& limits = options_.limits;
    const double half_square = 0.5 * last_interval_ * last_interval_;
    sigma = std::min(sigma, std::max(limits.least_leap, limits.most_acceleration * half_square));
    sigma_turn = std::min(sigma_turn, std::max(limits.least_spin, limits.most_spin * half_square));
  }
  return {velocity_, squares(sigma, sigma_turn).asDiagonal()};
}

LineMatch ScanOdometry::align(const Prediction& prediction, bool wheels, const GoingOn& before,
                              const Eigen::Vector2d& scanner, ScanMotion& motion) {
  PlanarPrior prior;
  prior.T_map_scan = T_local_body_ * prediction.T_prev_curr;
  prior.information = prediction.covariance.inverse();
  prior.robust = wheels && options_.robust_wheels;
  LineMatch match = match_lines(map_, points_, prior.T_map_scan, prior, options_.match);
  if (match.matched < options_.check_matched || usual_.worse(match.matched)) {
    // Wheels slip and bump: ask the scan from where constant velocity leads, without them. What
    // tells how far a corridor goes is a small share of its returns.
    LineMatch other = match_lines(map_, points_, T_local_body_ * velocity_, {}, options_.match);
    if (wheels) other = reconciled(prior, other);
    if (other.matched > match.matched + 0.05) match = other;
  }
  // A new room fits little of the map and is where wheels say: no reason to look far away.
  const auto unbelievable = [&] {
    const double least = wheels ? options_.lost_matched : options_.min_matched;
    return match.matched < least ||
           (match.matched < options_.sure_matched &&
            contradiction(match, prediction) > options_.contradiction_chi_squared);
  };
  // Without wheels nothing but the fit tells that a scan was matched beside its place.
  const bool beside = !wheels && usual_.worse(match.matched);
  // Between slow scans a body turns further than a match from constant velocity finds back from.
  const bool slow = !wheels && last_interval_ > options_.slow_alone;
  if ((match.matched < options_.min_matched || beside || slow || unbelievable()) && !map_.empty() &&
      points_.size() >= 10) {
    motion.searched = true;
    const PlanarPrior* observed = wheels ? &prior : nullptr;
    match = search_near(prediction, observed, match);
    // A new room fits less than usual, too; it fits no better elsewhere.
    if (unbelievable() || usual_.worse(match.matched))
      match = search_far(prediction, observed, match);
  }
  if (wheels) check_match(prior, prediction, scanner, match);
  if (wheels && before.dt > 0) hold_to_wheels(prior, prediction, before, match);
  return match;
}

LineMatch ScanOdometry::search_near(const Prediction& prediction, const PlanarPrior* wheels,
                                    const LineMatch& best) {
  SearchWindow window;
  const Eigen::Matrix3d& C = prediction.covariance;
  window.translation = std::clamp(3 * std::sqrt(std::max(C(0, 0), C(1, 1))),
                                  options_.search_translation, 4 * options_.search_translation);
  window.rotation =
      std::clamp(3 * std::sqrt(C(2, 2)), options_.search_rotation, 3 * options_.search_rotation);
  LineMatch match = search(T_local_body_ * prediction.T_prev_curr, window);
  if (wheels) match = reconciled(*wheels, match);
  return better(best, match);
}

// Wheels may be wrong by more than any noise: counters that take backwards for forwards, wheels
// that spin or are dragged. The way they tell bounds how far the robot can have come, any way
// round.
LineMatch ScanOdometry::search_far(const Prediction& prediction, const PlanarPrior* wheels,
                                   const LineMatch& best) {
  constexpr double kReach = 1, kTurn = 1;  // m, rad beyond it
  SearchWindow window;
  window.translation = kReach + 2 * prediction.T_prev_curr.translation().norm();
  window.rotation = kTurn + std::abs(prediction.T_prev_curr.yaw);
  LineMatch match = search(T_local_body_, window);
  if (wheels) match = reconciled(*wheels, match);
  // So far from where it was expected a place that looks alike may be another.
  return usual_.worse(match.matched) ? best : better(best, match);
}

LineMatch ScanOdometry::search(const PlanarPose& start, const SearchWindow& window) {
  if (!grid_) {
    std::vector<Eigen::Vector2d> points;
    for (const OrientedPoint& p : map_.points()) points.push_back(p.point);
    grid_.emplace(points, options_.search_resolution, options_.search_resolution, 5);
  }
  std::vector<Eigen::Vector2d> scan;
  for (const OrientedPoint& p : thinned(points_, 2 * options_.search_resolution)) {
    scan.push_back(p.point);
  }
  const auto found = search_correlative(*grid_, scan, start, window, 0.3);
  if (!found) return {};
  LineMatchOptions fine = options_.match;
  fine.start_radius = std::min(fine.start_radius, 6 * options_.search_resolution);
  return match_lines(map_, points_, found->T_map_scan, {}, fine);
}

// At the minimum scan and prediction pull alike: without the latter the match is where the former's
// information sends it.
std::optional<PlanarPose> ScanOdometry::alone(const Prediction& prediction,
                                              const LineMatch& match) const {
  const PlanarPose to_predicted =
      match.T_map_scan.inverse() * (T_local_body_ * prediction.T_prev_curr);
  const Eigen::Vector3d e(to_predicted.x, to_predicted.y, to_predicted.yaw);
  const Eigen::Vector3d d =
      match.prior_weight * match.information.inverse() * (prediction.covariance.inverse() * e);
  if (!d.allFinite()) return std::nullopt;
  return match.T_map_scan.boxplus(-d);
}

void ScanOdometry::fill(const Prediction& prediction, const LineMatch& match,
                        const std::optional<MotionGuess>& wheels, bool doubtful,
                        ScanMotion& motion) const {
  const bool lost =
      doubtful || match.matched < options_.lost_matched || match.unknown_directions == 3;
  const PlanarPose step =
      lost ? prediction.T_prev_curr : T_local_body_.inverse() * match.T_map_scan;
  motion.T_prev_curr_body = lifted(step);
  motion.matched = match.matched;
  motion.iterations = match.iterations;
  motion.unknown_directions = lost ? 3 : match.unknown_directions;
  motion.status = lost                           ? ScanMotion::Status::kPredicted
                  : match.unknown_directions > 0 ? ScanMotion::Status::kDegenerate
                                                 : ScanMotion::Status::kTracked;
  Eigen::Matrix3d planar = prediction.covariance;
  if (!lost) {
    const double moved = options_.sigma_motion * std::hypot(step.x, step.y);
    const double turned = options_.sigma_motion * std::abs(step.yaw);
    planar = (match.information + match.prior_weight * prediction.covariance.inverse()).inverse();
    planar.diagonal() +=
        squares(options_.sigma_translation + moved, options_.sigma_rotation + turned);
  }
  if (wheels) {
    Matrix6d seen = Matrix6d::Zero();
    if (!lost) set_planar_block(match.information, seen);
    motion.left_to_wheels = left_to_wheels(seen, wheels->covariance, lifted(step));
    motion.covariance = wheels->covariance;
  } else {
    const double h = options_.sigma_height, l = options_.sigma_level;
    motion.covariance.diagonal() << 0, 0, h * h, l * l, l * l, 0;
  }
  set_planar_block(0.5 * (planar + planar.transpose()), motion.covariance);
}

void ScanOdometry::keep_key_scan(const LineMatch& match, bool lost) {
  if (points_.empty()) return;
  if (lost) key_scans_.clear();
  if (!lost && match.iterations == 0) return;  // of no match: held to the wheels, or an outlier
  if (!key_scans_.empty()) {
    const PlanarPose d = key_scans_.back().T_local_body.inverse() * T_local_body_;
    const bool moved =
        std::hypot(d.x, d.y) > options_.key_translation || std::abs(d.yaw) > options_.key_rotation;
    const bool news = match.matched < options_.key_matched &&
                      (std::hypot(d.x, d.y) > 0.05 || std::abs(d.yaw) > 0.05);
    if (!moved && !news) return;
  }
  key_scans_.push_back({T_local_body_, transformed(points_, T_local_body_)});
  const auto far = [&](const KeyScan& k) {
    return (k.T_local_body.translation() - T_local_body_.translation()).norm() >
           options_.map_radius;
  };
  while (static_cast<int>(key_scans_.size()) > options_.key_scans || far(key_scans_.front())) {
    key_scans_.pop_front();
  }
  map_ = map_of(key_scans_);
  grid_.reset();
}

}  // namespace lamina
