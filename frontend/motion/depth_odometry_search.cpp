// Where else an image may have been taken than where it was expected.
#include <Eigen/LU>
#include <algorithm>

#include <lamina/frontend/motion/block_matching.hpp>
#include <lamina/frontend/motion/depth_odometry_parts.hpp>

namespace lamina {

std::vector<SE3> DepthOdometry::other_starts(const SE3& predicted, const SE3& T_body_camera,
                                             double sigma_turn) const {
  const double reach = 3 * sigma_turn, step = options_.coarse_gate / keys_.back().median_depth;
  std::vector<SE3> starts;
  if (reach <= step) return starts;
  // The turn has ended; the way goes on.
  starts.emplace_back(T_world_camera_.so3(), predicted.translation());
  const int each_way = std::min(8, static_cast<int>(std::ceil(reach / step)));
  for (int k = 1; k <= each_way; ++k) {
    for (const double turn : {k * step, -k * step}) {
      const SE3 about_body(SO3::rot_z(turn), Eigen::Vector3d::Zero());
      starts.push_back(predicted * T_body_camera.inverse() * about_body * T_body_camera);
    }
  }
  return starts;
}

// Blocks that leave the view speak for not turning: beside wheels, which do not grope, they must
// not be asked.
double DepthOdometry::gain(const DepthBlocks& current, const SE3& from, const SE3& to) const {
  const KeyFrame& key = keys_.back();
  const SE3 T_key_world = key.T_world_camera.inverse();
  return gained_agreement(
      key.blocks, current, T_key_world * from, T_key_world * to, options_.coarse_stride,
      {0, 4, 0, static_cast<float>(options_.min_normal_cosine), surface_variance()}, true);
}

bool DepthOdometry::explains(const DepthBlocks& current, const SE3& T_world_camera) const {
  if (keys_.empty()) return false;
  const KeyFrame& key = keys_.back();
  return agreement_in_view(key.blocks, current, key.T_world_camera.inverse() * T_world_camera,
                           options_.coarse_stride,
                           {0, 4, 0, static_cast<float>(options_.min_normal_cosine),
                            surface_variance()}) > options_.explained;
}

bool DepthOdometry::breaks_off(const Expectation& e, const SE3& T_world_camera) const {
  const auto body_step = [&](const SE3& T_prev_curr_camera) {
    return planar_part(e.T_body_camera * T_prev_curr_camera * e.T_body_camera.inverse());
  };
  const PlanarPose by_wheels = body_step(e.T_prev_curr), going_on = body_step(e.T_going_on);
  if (!e.by_wheels || options_.limits.wheels_stand(by_wheels)) return false;
  const PlanarPose found = body_step(T_world_camera_.inverse() * T_world_camera);
  return options_.limits.leaps(found, by_wheels, going_on, e.dt) ||
         options_.limits.spins(found, by_wheels, going_on, e.dt);
}

std::optional<SE3> DepthOdometry::search(const DepthBlocks& current, const Expectation& e,
                                         const SE3& T_body_camera, const std::vector<SE3>& starts,
                                         const Alignment& a) const {
  const double as_it_is = e.by_wheels ? 0 : fit(current, a.T_world_camera);
  double best = options_.search_gain;
  std::optional<SE3> better;
  for (const SE3& start : starts) {
    Alignment tried;
    tried.T_world_camera = start;
    align(current, start, e.information, tried, options_.coarse_iterations, e.by_wheels ? 0 : 2);
    // Most starts beside right wheels come back to where they say: no fine steps for these.
    if (e.by_wheels) {
      if (gain(current, a.T_world_camera, tried.T_world_camera) <= 0.5 * best) continue;
      align(current, start, e.information, tried, 0, 2);
    }
    // Without wheels it must fit more in all, and of what both have in view: along a bare wall any
    // place fits, and that which shares more of the view would win.
    double gained = gain(current, a.T_world_camera, tried.T_world_camera);
    if (gained <= best) continue;
    if (!e.by_wheels) gained = std::min(gained, fit(current, tried.T_world_camera) - as_it_is);
    if (gained <= best || (e.by_wheels && !slipped(a, tried, T_body_camera))) continue;
    if (breaks_off(e, tried.T_world_camera)) continue;
    best = gained;
    better = start;
  }
  return better;
}

// A bare floor fits however the camera turns, and a wall however it slides along it.
bool DepthOdometry::slipped(const Alignment& a, const Alignment& b,
                            const SE3& T_body_camera) const {
  const SE3 T_b_a = b.T_world_camera.inverse() * a.T_world_camera;
  const Vector6d d = T_b_a.log();
  const SE3 of_body = T_body_camera * T_b_a * T_body_camera.inverse();
  return d.dot(b.information * d) > options_.observed_chi_squared &&
         of_body.translation().norm() <
             options_.fine_gate + options_.half_track * of_body.so3().log().norm();
}

void DepthOdometry::slide(const DepthBlocks& current, const Matrix6d& prior, Alignment& a) const {
  const KeyFrame& key = keys_.back();
  const SE3 T_key_now = key.T_world_camera.inverse() * a.T_world_camera;
  const BlockGate gate{0, 4, 0, static_cast<float>(options_.min_normal_cosine), surface_variance()};
  double best = 0;
  std::optional<SE3> better;
  for (const Vector6d& direction : a.open) {
    const double sigma = 1 / std::sqrt(direction.dot(prior * direction));
    for (const double sigmas : {0.25, -0.25, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0}) {
      const SE3 start = a.T_world_camera * SE3::exp(sigmas * sigma * direction);
      const SE3 T_key_start = key.T_world_camera.inverse() * start;
      const double found = gained_agreement(key.blocks, current, T_key_now, T_key_start,
                                            options_.coarse_stride, gate) -
                           options_.slide_gain * (1 + sigmas * sigmas);
      if (found <= best) continue;
      best = found;
      better = start;
    }
  }
  if (!better) return;
  a.T_world_camera = *better;
  align(current, *better, prior, a, 0, options_.fine_iterations);
}

bool DepthOdometry::contradicted(const DepthBlocks& current, const Alignment& a) const {
  if (usual_.worse(a.matched)) return true;
  const SE3 no_turn(T_world_camera_.so3(), a.T_world_camera.translation());
  return gain(current, a.T_world_camera, no_turn) > 0.5 * options_.search_gain;
}

namespace {

// What of a way lies across the floor and in heading, which is all that wheels count. Tangents of
// the camera, as `d`.
struct AcrossFloor {
  Vector6d d = Vector6d::Zero();
  double sigmas_squared = 0;  ///< of it, by the noise of wheels and image
  AcrossFloor(const Vector6d& d_camera, const Matrix6d& wheels, const Matrix6d& image,
              const SE3& T_body_camera) {
    const Matrix6d Ad = T_body_camera.adjoint();
    const Vector6d of_body = Ad * d_camera;
    const Matrix6d known = image + Matrix6d::Identity();  // information: a metre, a radian
    const Matrix6d covariance = Ad * (wheels + known.inverse()) * Ad.transpose();
    const Eigen::Vector3d e(of_body(0), of_body(1), of_body(5));
    sigmas_squared = e.dot(planar_block(covariance).ldlt().solve(e));
    Vector6d across = Vector6d::Zero();
    across << e(0), e(1), 0, 0, 0, e(2);
    d = T_body_camera.inverse().adjoint() * across;
  }
};

}  // namespace

bool DepthOdometry::pulls_away(const DepthBlocks& current, const Expectation& e,
                               const Alignment& a) const {
  const Matrix6d information = a.information + Matrix6d::Identity();  // a metre, a radian
  const Vector6d off = information.ldlt().solve(a.pull) + e.covariance * a.pull;
  if (a.pull.dot(off) > options_.observed_chi_squared) return true;
  const bool stand = e.T_prev_curr.log().norm() < options_.sigma_translation;
  return stand ? a.matched < options_.search_matched : contradicted(current, a);
}

bool DepthOdometry::overrule(const DepthBlocks& current, Expectation& e, Alignment& a) const {
  if (!pulls_away(current, e, a)) return false;
  Expectation free = e;
  free.widen(e.sigma_velocity, e.sigma_turn);
  const SE3 ended(SO3(), e.T_going_on.translation());  // the turn, and the way goes on
  const SE3 begun(SE3::exp(0.5 * e.T_going_on.log()));
  double best = 2 * options_.search_gain;  // pieces that were matched by chance come and go
  const SE3 by_wheels = T_world_camera_ * e.T_prev_curr;
  const auto across = [&](const Alignment& at) {
    return AcrossFloor((at.T_world_camera.inverse() * by_wheels).log(), e.covariance,
                       at.information, e.T_body_camera);
  };
  // Where the image rests within the wheels' noise it must fit clearly worse, too: half a degree,
  // which wheels leave open, lays a wall beside itself.
  const Alignment with_wheels = a;
  const bool in_noise = across(a).sigmas_squared <= options_.observed_chi_squared;
  for (const SE3& T_prev_curr : {e.T_prev_curr, e.T_going_on, ended, begun}) {
    Alignment other;
    const SE3 start = other.T_world_camera = T_world_camera_ * T_prev_curr;
    align(current, start, free.information, other, options_.coarse_iterations,
          options_.fine_iterations);
    const AcrossFloor way = across(other);
    if (!(way.sigmas_squared > options_.observed_chi_squared)) continue;
    if (breaks_off(e, other.T_world_camera) || !explains(current, other.T_world_camera)) continue;
    // Wheels say nothing of a body that tilts.
    double gained = gain(current, other.T_world_camera * SE3::exp(way.d), other.T_world_camera);
    if (in_noise)
      gained = std::min(gained, gain(current, with_wheels.T_world_camera, other.T_world_camera));
    if (gained <= best) continue;
    best = gained;
    e.overruled = true;
    a = other;
  }
  if (!e.overruled) return false;
  e = free;
  e.overruled = true;
  return true;
}

DepthOdometry::Alignment DepthOdometry::locate(const DepthBlocks& current, const SE3& T_body_camera,
                                               Expectation& e) const {
  Alignment a = aligned_as_expected(current, e);
  if (keys_.empty() || (e.by_wheels && overrule(current, e, a))) return a;
  const bool fits = e.by_wheels ? !contradicted(current, a)
                                : a.matched >= options_.search_matched && a.unknown == 0;
  if (!fits) {
    Expectation other = e;  // of other starts: wheels that slip tell no more than the last motion
    if (e.by_wheels) other.widen(e.sigma_velocity, e.sigma_turn);
    const SE3 predicted = T_world_camera_ * e.T_prev_curr;
    const auto better = search(current, other, T_body_camera,
                               other_starts(predicted, T_body_camera, e.sigma_turn), a);
    if (better) {
      e = other;
      e.searched = e.by_wheels;
      // What surfaces leave open stays as this start has it.
      a.T_world_camera = *better;
      align(current, *better, e.information, a, options_.coarse_iterations,
            options_.fine_iterations);
    }
  }
  slide(current, e.information, a);
  return a;
}

}  // namespace lamina
