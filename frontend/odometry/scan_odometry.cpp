// Scan to local map: predict, align, report, keep key scans.
#include <lamina/frontend/odometry/scan_odometry.hpp>

#include <Eigen/LU>
#include <algorithm>

#include <lamina/frontend/odometry/seen_through.hpp>

namespace lamina {
namespace {

Eigen::Vector3d squares(double xy, double yaw) { return {xy * xy, xy * xy, yaw * yaw}; }

// Only a clearly better fit overrules the motion that was expected.
const LineMatch& better(const LineMatch& expected, const LineMatch& found) {
  return found.matched > expected.matched + 0.1 ? found : expected;
}

// Below, wheels stand.
constexpr double kStands = 1e-3;  // m

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

// How far a match is from a prior, by the noise of both: e' (A^-1 + P^-1)^-1 e. What the scan does
// not tell (A without rank) adds nothing.
double against(const LineMatch& match, const PlanarPrior& prior) {
  const PlanarPose off = prior.T_map_scan.inverse() * match.T_map_scan;
  const Eigen::Vector3d e(off.x, off.y, off.yaw);
  const Eigen::Matrix3d C = prior.information.inverse();
  const Eigen::Matrix3d sum = Eigen::Matrix3d::Identity() + match.information * C;
  return e.dot(sum.partialPivLu().solve(match.information * e));
}

}  // namespace

ScanOdometry::ScanOdometry(const ScanOdometryOptions& options) : options_(options) {}

ScanMotion ScanOdometry::process(const LaserScan& scan, const std::optional<MotionGuess>& wheels,
                                 bool slopes) {
  const Eigen::Vector3d z_body = scan.lidar.T_body_lidar.so3() * Eigen::Vector3d::UnitZ();
  const bool level = std::abs(z_body.z()) >= std::cos(options_.max_tilt);
  points_.clear();
  if (level) points_ = thinned(oriented_points(scan, options_.points), options_.thin_cell);
  ScanMotion motion;
  if (key_scans_.empty()) {
    if (!wheels) {
      if (!points_.empty()) usual_.began(scan.stamp);
      keep_key_scan({}, true);
      return motion;
    }
  }
  const Prediction prediction = predict(wheels);
  const double dt = last_stamp_ ? scan.stamp - *last_stamp_ : 0;
  GoingOn going_on;
  if (dt > 0 && dt < 2 * last_interval_ && last_interval_ < 2 * dt) {
    const double share = dt / last_interval_;
    going_on = {dt, {share * velocity_.x, share * velocity_.y, share * velocity_.yaw}};
    going_on.even = std::abs(dt - last_interval_) < 0.2 * dt;
  }
  const bool go_on = wheels && told_ && wheels_go_on(*wheels, dt, last_interval_);
  last_stamp_ = scan.stamp;
  last_interval_ = dt;
  const Eigen::Vector2d scanner = scan.lidar.T_body_lidar.translation().head<2>();
  LineMatch match = align(prediction, wheels.has_value(), going_on, scanner, motion);
  if (options_.doubt_wheels)
    compare(wheels, match, match.matched < options_.lost_matched || slopes);
  if (doubt_.slips()) {
    const LineMatch alone =
        match_lines(map_, points_, T_local_body_ * velocity_, {}, options_.match);
    if (tells_otherwise(alone, match, points_, planar_part(wheels->T_prev_curr_body))) {
      match = alone;
      match.prior_weight = 0;
      motion.wheels_slipped = true;
    }
  }
  const bool frozen = usual_.repeated(scan.ranges);
  const bool doubtful = !wheels && usual_.gap_before(scan.stamp) && usual_.worse(match.matched);
  fill(prediction, match, wheels, doubtful, motion);
  const bool lost = motion.status == ScanMotion::Status::kPredicted;
  motion.wheels_went_on = lost && go_on;
  told_ = !lost;
  if (!lost && !frozen) {
    usual_.tracked(scan.stamp, motion.matched);
  } else if (lost && !points_.empty()) {
    usual_.began(scan.stamp);
  }
  const std::optional<PlanarPose> before = T_local_alone_;
  T_local_alone_.reset();
  if (motion.status == ScanMotion::Status::kTracked) T_local_alone_ = alone(prediction, match);
  if (before && T_local_alone_) motion.by_scans_alone = lifted(before->inverse() * *T_local_alone_);
  const PlanarPose step = planar_part(motion.T_prev_curr_body);
  T_local_body_ = T_local_body_ * step;
  velocity_ = step;
  keep_key_scan(match, lost);
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
  return {velocity_, squares(options_.sigma_velocity, options_.sigma_turn).asDiagonal()};
}

LineMatch ScanOdometry::align(const Prediction& prediction, bool wheels, const GoingOn& before,
                              const Eigen::Vector2d& scanner, ScanMotion& motion) {
  PlanarPrior prior;
  prior.T_map_scan = T_local_body_ * prediction.T_prev_curr;
  prior.information = prediction.covariance.inverse();
  prior.robust = wheels && options_.robust_wheels;
  LineMatch match = match_lines(map_, points_, prior.T_map_scan, prior, options_.match);
  if (match.matched < options_.doubt_matched || usual_.worse(match.matched)) {
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
  if ((match.matched < options_.min_matched || beside || unbelievable()) && !map_.empty() &&
      points_.size() >= 10) {
    motion.searched = true;
    const PlanarPrior* told = wheels ? &prior : nullptr;
    match = search_near(prediction, told, match);
    // A new room fits less than usual, too; it fits no better elsewhere.
    if (unbelievable() || usual_.worse(match.matched)) match = search_far(prediction, told, match);
  }
  if (wheels) doubt_what_came(prior, prediction, scanner, match);
  if (wheels && before.dt > 0) hold_to_wheels(prior, prediction, before, match);
  return match;
}

// People who walk along beside a scanner in a bare corridor show more of what tells the way than
// its walls do, and the match follows them. They walk where scans before saw through.
void ScanOdometry::doubt_what_came(const PlanarPrior& wheels, const Prediction& prediction,
                                   const Eigen::Vector2d& scanner, LineMatch& match) {
  constexpr double kClear = 11.3, kMargin = 0.15;  // 3 dof, 1 %; m
  constexpr double kMost = 0.3;  // of the scan: more is a place that was taken for another
  const bool stands = prediction.T_prev_curr.translation().norm() < kStands;
  if (map_.empty() || stands || !(contradiction(match, prediction) >= kClear)) return;
  std::vector<SightFan> fans;
  for (const KeyScan& key : key_scans_) {
    fans.push_back(
        sight_fan(transformed(key.points, key.T_local_body.inverse()), scanner, key.T_local_body));
  }
  // Wherever the body is: a wall is where it was seen at the pose of one of the two.
  std::vector<bool> came = seen_through(points_, fans, wheels.T_map_scan, kMargin);
  const std::vector<bool> there = seen_through(points_, fans, match.T_map_scan, kMargin);
  for (std::size_t i = 0; i < came.size(); ++i) came[i] = came[i] && there[i];
  const double most = kMost * static_cast<double>(points_.size());
  const auto count = std::count(came.begin(), came.end(), true);
  if (count == 0 || static_cast<double>(count) > most) return;
  std::vector<OrientedPoint> rest = without(points_, came);
  if (static_cast<double>(points_.size() - rest.size()) > most) return;
  const LineMatch other = match_lines(map_, rest, wheels.T_map_scan, wheels, options_.match);
  const double as_found = match_cost(map_, rest, match.T_map_scan, wheels, options_.match);
  const double as_told = match_cost(map_, rest, other.T_map_scan, wheels, options_.match);
  if (!(as_told < as_found) || !(contradiction(other, prediction) < kClear)) return;
  match = other;
  match.matched *= static_cast<double>(rest.size()) / static_cast<double>(points_.size());
  points_ = std::move(rest);
}

// No robot leaps: where the scan does and wheels go on as before, the scan is led by what is no
// wall (the ground at the end of a ramp, which runs ahead of a scanner that tips).
void ScanOdometry::hold_to_wheels(const PlanarPrior& wheels, const Prediction& prediction,
                                  const GoingOn& before, LineMatch& match) const {
  if (map_.empty() || contradiction(match, prediction) < options_.contradiction_chi_squared) return;
  // Wheels that stand do not go on: they may not be counted, and a robot that stands does not tip.
  if (prediction.T_prev_curr.translation().norm() < kStands) return;
  const auto from_before = [&](const PlanarPose& T_map_scan) {
    return before.motion.inverse() * (T_local_body_.inverse() * T_map_scan);
  };
  const PlanarPose found = from_before(match.T_map_scan), told = from_before(wheels.T_map_scan);
  const double leap = found.translation().norm(), turn = std::abs(found.yaw);
  const double square = before.dt * before.dt, told_leap = told.translation().norm();
  const bool leaps = before.even && told_leap <= options_.steady * leap &&
                     leap >= options_.least_leap + options_.most_acceleration * square;
  const bool spins = turn >= options_.least_spin + options_.most_spin * square &&
                     std::abs(told.yaw) <= options_.steady * turn;
  if (!leaps && !spins) return;
  constexpr double kFirm = 1e4;  // times the wheels' information
  PlanarPrior firm = wheels;
  firm.information *= kFirm;
  firm.robust = false;
  const PlanarPose off = wheels.T_map_scan.inverse() * match.T_map_scan;
  match = match_lines(map_, points_, wheels.T_map_scan, firm, options_.match);
  // The scan says nothing of that way.
  const Eigen::Vector3d e(off.x, off.y, off.yaw), weight = match.information * e;
  const double along = e.dot(weight);
  if (along > 0) match.information -= weight * weight.transpose() / along;
  match.unknown_directions = std::max(1, match.unknown_directions);
}

// Far from what was expected, by that expectation's own measure.
double ScanOdometry::contradiction(const LineMatch& match, const Prediction& prediction) const {
  const PlanarPose off =
      prediction.T_prev_curr.inverse() * (T_local_body_.inverse() * match.T_map_scan);
  const Eigen::Vector3d e(off.x, off.y, off.yaw);
  return e.dot(prediction.covariance.inverse() * e);
}

// A match found without wheels overrules them only where its scan tells, by more than the noise of
// both. Along a corridor it came to lie wherever it was begun from.
LineMatch ScanOdometry::reconciled(const PlanarPrior& wheels, const LineMatch& found) const {
  constexpr double kClear = 11.3;  // 3 dof, 1 %
  const bool none = found.iterations == 0;
  if (none || (found.unknown_directions == 0 && against(found, wheels) > kClear)) return found;
  return match_lines(map_, points_, found.T_map_scan, wheels, options_.match);
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

void ScanOdometry::compare(const std::optional<MotionGuess>& wheels, const LineMatch& match,
                           bool lost) {
  if (!wheels || lost || match.unknown_directions > 0) return doubt_.forget();
  const PlanarPose by_wheels = planar_part(wheels->T_prev_curr_body);
  if (by_wheels.translation().norm() < kStands) return doubt_.forget();
  const Eigen::Vector2d ahead = by_wheels.translation().normalized();  // in the previous body
  const PlanarPose step = T_local_body_.inverse() * match.T_map_scan;
  Eigen::Vector3d u = Eigen::Vector3d::Zero();  // in the tangent of the current one
  u.head<2>() = by_wheels.rotation().transpose() * ahead;
  const double wheels_variance = u.dot(planar_block(wheels->covariance) * u);
  doubt_.add(ahead.dot(step.translation() - by_wheels.translation()), wheels_variance,
             u.dot(match.information.inverse() * u));
}

// Taking a robot away and setting it down takes longer than this, and its wheels do not drive then.
bool ScanOdometry::wheels_go_on(const MotionGuess& wheels, double dt,
                                double interval_before) const {
  constexpr double kSetDown = 1;       // s
  constexpr double kTurning = 5;       // rad/s^2, of robots that begin or end a turn
  constexpr double kLeastTurn = 0.05;  // rad between scans: what wheels and scans are off by
  if (!(dt > 0 && dt < kSetDown && interval_before > 0)) return false;
  const PlanarPose step = planar_part(wheels.T_prev_curr_body);
  const Eigen::Vector2d now = step.translation() / dt;
  const Eigen::Vector2d before = velocity_.translation() / interval_before;
  if (step.translation().norm() < kStands) return false;
  const double turned = std::abs(step.yaw - velocity_.yaw * dt / interval_before);
  return (now - before).norm() < options_.steady * now.norm() &&
         turned < kLeastTurn + kTurning * dt * dt;
}

void ScanOdometry::keep_key_scan(const LineMatch& match, bool lost) {
  if (points_.empty()) return;
  if (lost) key_scans_.clear();
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
  std::vector<OrientedPoint> all;
  for (const KeyScan& k : key_scans_) {
    for (const OrientedPoint& p : k.points) {
      if (p.oriented()) all.push_back(p);
    }
  }
  map_ = PointMap(std::move(all));
  grid_.reset();
}

}  // namespace lamina
