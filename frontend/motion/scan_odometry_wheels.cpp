// What wheels have to say where a scan contradicts them, and the other way round.
#include <Eigen/LU>
#include <algorithm>

#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/motion/seen_through.hpp>

namespace lamina {
namespace {

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

// People who walk along beside a scanner in a bare corridor show more of what tells the way than
// its walls do, and the match follows them. They walk where scans before saw through.
void ScanOdometry::check_match(const PlanarPrior& wheels, const Prediction& prediction,
                               const Eigen::Vector2d& scanner, LineMatch& match) {
  constexpr double kClear = 11.3, kMargin = 0.15;  // 3 dof, 1 %; m
  constexpr double kMost = 0.3;  // of the scan: more is a place that was taken for another
  const bool stands = prediction.T_prev_curr.translation().norm() < options_.limits.stands;
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
  const double as_observed = match_cost(map_, rest, other.T_map_scan, wheels, options_.match);
  if (!(as_observed < as_found) || !(contradiction(other, prediction) < kClear)) return;
  match = other;
  match.matched *= static_cast<double>(rest.size()) / static_cast<double>(points_.size());
  points_ = std::move(rest);
}

// A match that contradicts the wheels has to explain the scan for what it costs to have slipped: a
// scan that fits nowhere (the robot tips) fits anywhere about as badly. And no robot leaps: where
// the scan does and wheels go on as before, it is led by what is no wall (the ground at the end of
// a ramp, which runs ahead of a scanner that tips).
void ScanOdometry::hold_to_wheels(const PlanarPrior& wheels, const Prediction& prediction,
                                  const GoingOn& before, LineMatch& match) const {
  if (map_.empty() || contradiction(match, prediction) < options_.contradiction_chi_squared) return;
  // Wheels that stand do not go on: they may not be counted, and a robot that stands does not tip.
  const MotionLimits& limits = options_.limits;
  const PlanarPose& counted = prediction.T_prev_curr;
  if (limits.wheels_stand(counted)) return;
  const PlanarPose found = T_local_body_.inverse() * match.T_map_scan;
  const bool leaps = before.even && limits.leaps(found, counted, before.motion, before.dt);
  const bool spins = limits.spins(found, counted, before.motion, before.dt);
  constexpr double kFirm = 1e4;  // times the wheels' information
  PlanarPrior firm = wheels;
  firm.information *= kFirm;
  firm.robust = false;
  const LineMatch held = match_lines(map_, points_, wheels.T_map_scan, firm, options_.match);
  const auto cost = [&](const LineMatch& m) {
    return match_cost(map_, points_, m.T_map_scan, wheels, options_.match);
  };
  if (!leaps && !spins && cost(match) < cost(held)) return;
  const PlanarPose off = wheels.T_map_scan.inverse() * match.T_map_scan;
  match = held;
  // The scan says nothing of that way.
  const Eigen::Vector3d e(off.x, off.y, off.yaw), weight = match.information * e;
  const double along = e.dot(weight);
  if (along > 0) match.information -= weight * weight.transpose() / along;
  match.unknown_directions = std::max(1, match.unknown_directions);
  match.iterations = 0;  // no match of its own: nor does it show anything of the place
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

void ScanOdometry::compare(const std::optional<MotionGuess>& wheels, const LineMatch& match,
                           bool lost) {
  if (!wheels || lost || match.unknown_directions > 0) return slip_detector_.forget();
  const PlanarPose by_wheels = planar_part(wheels->T_prev_curr_body);
  if (by_wheels.translation().norm() < options_.limits.stands) return slip_detector_.forget();
  const Eigen::Vector2d ahead = by_wheels.translation().normalized();  // in the previous body
  const PlanarPose step = T_local_body_.inverse() * match.T_map_scan;
  Eigen::Vector3d u = Eigen::Vector3d::Zero();  // in the tangent of the current one
  u.head<2>() = by_wheels.rotation().transpose() * ahead;
  const double wheels_variance = u.dot(planar_block(wheels->covariance) * u);
  slip_detector_.add(ahead.dot(step.translation() - by_wheels.translation()), wheels_variance,
                     u.dot(match.information.inverse() * u));
}

// Taking a robot away and setting it down takes longer than this, and its wheels do not drive then.
bool ScanOdometry::wheels_go_on(const MotionGuess& wheels, double dt,
                                double interval_before) const {
  constexpr double kTurning = 5;       // rad/s^2, of robots that begin or end a turn
  constexpr double kLeastTurn = 0.05;  // rad between scans: what wheels and scans are off by
  if (!(dt > 0 && interval_before > 0)) return false;
  const PlanarPose step = planar_part(wheels.T_prev_curr_body);
  const Eigen::Vector2d now = step.translation() / dt;
  const Eigen::Vector2d before = velocity_.translation() / interval_before;
  if (step.translation().norm() < options_.limits.stands) return false;
  const double turned = std::abs(step.yaw - velocity_.yaw * dt / interval_before);
  return (now - before).norm() < options_.limits.steady * now.norm() &&
         turned < kLeastTurn + kTurning * dt * dt;
}

}  // namespace lamina
