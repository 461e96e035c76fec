// Frame to key frames by projective point-to-plane Gauss-Newton.
#include <lamina/frontend/odometry/depth_odometry.hpp>

#include <Eigen/Cholesky>
#include <algorithm>

#include <lamina/frontend/odometry/block_matching.hpp>
#include <lamina/frontend/odometry/moving_blocks.hpp>
#include <lamina/frontend/odometry/travel.hpp>

namespace lamina {

/// Of the next image, before it is looked at. Camera frame.
struct DepthOdometry::Expectation {
  SE3 T_prev_curr;
  Matrix6d covariance = Matrix6d::Zero(), information = Matrix6d::Zero();
  double sigma_velocity = 0, sigma_turn = 0;  ///< m, rad: where nothing but the last motion tells
  bool by_wheels = false;
  void widen(double sigma_translation, double sigma_rotation) {
    covariance.diagonal().head<3>().array() += sigma_translation * sigma_translation;
    covariance.diagonal().tail<3>().array() += sigma_rotation * sigma_rotation;
    information = covariance.ldlt().solve(Matrix6d::Identity());
  }
};

struct DepthOdometry::Alignment {
  SE3 T_world_camera;
  Matrix6d information = Matrix6d::Zero();  ///< of the image alone
  Vector6d pull = Vector6d::Zero();         ///< information (by the image alone - as aligned)
  int unknown = 6;
  std::vector<Vector6d> open;  ///< the unknown directions, camera tangents
  double matched = 0, rms = 0;
};

DepthOdometry::DepthOdometry(const DepthOdometryOptions& options) : options_(options) {}

std::vector<const DepthOdometry::KeyFrame*> DepthOdometry::references(
    const DepthBlocks& current, const SE3& T_world_camera) const {
  std::vector<const KeyFrame*> result;
  if (keys_.empty()) return result;
  result.push_back(&keys_.back());
  const float beside = 0.0625F;
  for (const KeyFrame& key : keys_) {
    if (&key == &keys_.back()) break;
    BlockSums sums;
    accumulate(key.blocks, current, key.T_world_camera.inverse() * T_world_camera, 6,
               {static_cast<float>(options_.fine_gate), 4, beside, 0.8F, surface_variance()}, {},
               sums);
    if (sums.tried > 0 && sums.used > options_.old_overlap * sums.tried) {
      result.push_back(&key);
      break;
    }
  }
  return result;
}

// From a.T_world_camera; `predicted` is what the prior is about.
void DepthOdometry::align(const DepthBlocks& current, const SE3& predicted, const Matrix6d& prior,
                          Alignment& a, int coarse_iterations, int fine_iterations) const {
  const auto keys = references(current, a.T_world_camera);
  if (keys.empty()) return;
  const int iterations = coarse_iterations + fine_iterations;
  bool fine = false;
  std::vector<HardDirection> hard;
  for (int i = 0, left = coarse_iterations; i < iterations; ++i, --left) {
    if (!fine && left <= 0) {
      fine = true;
      left = fine_iterations;
    }
    const double shrink = std::pow(0.6, i);
    const double distance =
        fine ? options_.fine_gate : std::max(options_.fine_gate, options_.coarse_gate * shrink);
    const BlockGate gate{static_cast<float>(distance), 4, 0.0625F,
                         static_cast<float>(options_.min_normal_cosine), surface_variance()};
    BlockSums s;
    for (const KeyFrame* key : keys) {
      accumulate(key->blocks, current, key->T_world_camera.inverse() * a.T_world_camera,
                 fine ? 1 : options_.coarse_stride, gate, hard, s);
    }
    const double skipped = fine ? 1.0 : options_.coarse_stride * options_.coarse_stride;
    const double per_fact =
        std::max(1.0, options_.samples_per_fact / skipped) * static_cast<double>(keys.size());
    a.information = s.H / per_fact;
    // Once for coarse, once for fine steps: blocks that go in and out would keep it from resting.
    if (i == 0 || (fine && left == fine_iterations))
      hard = hard_directions(s.H, keys.front()->median_depth, options_.hard_share);
    Vector6d b = s.b / per_fact;
    a.open = without_weak_directions(a.information, b,
                                     options_.normal_noise_factor / per_fact * s.spurious,
                                     keys.front()->median_depth, options_.min_information);
    a.unknown = static_cast<int>(a.open.size());
    a.matched = s.tried > 0 ? static_cast<double>(s.used) / s.tried : 0;
    a.rms = s.used > 0 ? std::sqrt(s.squares / s.used) : 0;
    const Vector6d back = (a.T_world_camera.inverse() * predicted).log();
    const Vector6d d = (a.information + prior).ldlt().solve(b + prior * back);
    if (!d.allFinite()) {
      a = Alignment{};
      a.T_world_camera = predicted;
      return;
    }
    a.T_world_camera = a.T_world_camera * SE3::exp(d);
    const double step = d.head<3>().norm() + keys.front()->median_depth * d.tail<3>().norm();
    if (fine && step < 1e-4) break;
    if (!fine && step < 1e-3) left = 0;
  }
  a.pull = -prior * (a.T_world_camera.inverse() * predicted).log();
}

double DepthOdometry::fit(const DepthBlocks& current, const SE3& T_world_camera) const {
  const KeyFrame& key = keys_.back();
  BlockSums sums;
  accumulate(key.blocks, current, key.T_world_camera.inverse() * T_world_camera,
             options_.coarse_stride,
             {0, 4, 0.0625F, static_cast<float>(options_.min_normal_cosine), surface_variance()},
             {}, sums);
  return sums.tried > 0 ? sums.agreement / sums.tried : 0;
}

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
  return d.dot(b.information * d) > options_.told_chi_squared &&
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

// Ahead and in heading as before. Sideways and up to the usual velocity: who carries a camera along
// a wall and looks at it goes on, what sways comes back. Roll and pitch come to rest, or where
// surfaces leave them open a body that sways is turned over.
SE3 DepthOdometry::going_on(double dt, const SE3& T_body_camera) const {
  if (dt > options_.max_step) return {};
  Vector6d of_body = T_body_camera.adjoint() * velocity_;
  const double rest = std::exp(-dt / options_.rest_time);
  for (const int k : {1, 2})
    of_body(k) = usual_velocity_(k) + rest * (of_body(k) - usual_velocity_(k));
  for (const int k : {3, 4}) of_body(k) *= rest;
  return SE3::exp(T_body_camera.inverse().adjoint() * of_body * dt);
}

// The last motion goes on, or what wheels say.
DepthOdometry::Expectation DepthOdometry::expect(double dt, const SE3& T_body_camera,
                                                 const std::optional<MotionGuess>& guess) const {
  Expectation e;
  const double ratio = std::max(1.0, dt / options_.frame_time);
  if (guess) {
    e.T_prev_curr = T_body_camera.inverse() * guess->T_prev_curr_body * T_body_camera;
    const Matrix6d Ad = T_body_camera.inverse().adjoint();
    e.covariance = Ad * guess->covariance * Ad.transpose();
    e.covariance.diagonal().array() += 1e-9;
    e.by_wheels = true;
  } else {
    e.T_prev_curr = going_on(dt, T_body_camera);
  }
  e.sigma_velocity = options_.sigma_velocity * ratio;
  e.sigma_turn = options_.sigma_turn * ratio;
  e.widen(guess ? 0 : e.sigma_velocity, guess ? 0 : e.sigma_turn);
  return e;
}

DepthOdometry::Alignment DepthOdometry::aligned_as_expected(const DepthBlocks& current,
                                                            const Expectation& e) const {
  Alignment a;
  const SE3 predicted = T_world_camera_ * e.T_prev_curr;
  a.T_world_camera = predicted;
  align(current, predicted, e.information, a, options_.coarse_iterations, options_.fine_iterations);
  return a;
}

bool DepthOdometry::contradicted(const DepthBlocks& current, const Alignment& a) const {
  if (usual_.worse(a.matched)) return true;
  const SE3 no_turn(T_world_camera_.so3(), a.T_world_camera.translation());
  return gain(current, a.T_world_camera, no_turn) > 0.5 * options_.search_gain;
}

DepthOdometry::Alignment DepthOdometry::locate(const DepthBlocks& current, const SE3& T_body_camera,
                                               Expectation& e) const {
  Alignment a = aligned_as_expected(current, e);
  if (keys_.empty()) return a;
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
      // What surfaces leave open stays as this start has it.
      a.T_world_camera = *better;
      align(current, *better, e.information, a, options_.coarse_iterations,
            options_.fine_iterations);
    }
  }
  slide(current, e.information, a);
  return a;
}

DepthMotion DepthOdometry::process(const DepthFrame& frame,
                                   const std::optional<MotionGuess>& guess) {
  DepthMotion motion;
  DepthBlocks current = depth_blocks(frame, options_.blocks);
  if (!last_stamp_) {
    last_stamp_ = frame.stamp;
    usual_.began(frame.stamp);
    keep_key_frame(std::move(current), true, motion);
    return motion;
  }
  const double dt = std::max(1e-4, frame.stamp - *last_stamp_);
  last_stamp_ = frame.stamp;
  const SE3& T_body_camera = frame.camera.camera.T_body_camera;
  const Expectation at_first = expect(dt, T_body_camera, guess);
  Expectation expected = at_first;
  Alignment a = locate(current, T_body_camera, expected);
  motion.moving = drop_what_moved(current, a.T_world_camera);
  // With what is left, other starts and places along open directions are not believed again: a
  // person who walked by made a map 0.17 m off of it, and nothing said so.
  if (motion.moving > 0) {
    expected = at_first;
    a = aligned_as_expected(current, expected);
    last_moving_ = frame.stamp;
  }
  const bool unlike =
      !guess && usual_.gap_before(frame.stamp) && (a.unknown > 0 || usual_.worse(a.matched));
  const bool lost = unlike || a.matched < options_.lost_matched || a.unknown == 6;
  const bool frozen = usual_.repeated(frame.raw);
  if (lost) {
    usual_.began(frame.stamp);
  } else if (!frozen) {
    usual_.tracked(frame.stamp, a.matched);
  }
  motion.status = lost            ? ScanMotion::Status::kPredicted
                  : a.unknown > 0 ? ScanMotion::Status::kDegenerate
                                  : ScanMotion::Status::kTracked;
  motion.unknown_directions = lost ? 6 : a.unknown;
  motion.matched = a.matched;
  motion.rms = a.rms;
  const SE3 step = lost ? expected.T_prev_curr : T_world_camera_.inverse() * a.T_world_camera;
  motion.T_prev_curr_body = T_body_camera * step * T_body_camera.inverse();
  motion.doubtful = !lost && doubts(expected, step, frame.stamp);
  Matrix6d covariance = lost ? expected.covariance : covariance_of(a, expected, step);
  if (motion.doubtful) covariance += expected.covariance;
  const Matrix6d Ad = T_body_camera.adjoint();
  motion.covariance = Ad * covariance * Ad.transpose();
  motion.covariance = 0.5 * (motion.covariance + motion.covariance.transpose()).eval();
  if (!lost) {
    const Matrix6d Ad_inverse = T_body_camera.inverse().adjoint();
    motion.image_information = Ad_inverse.transpose() * a.information * Ad_inverse;
    motion.image_pull = Ad_inverse.transpose() * a.pull;
  }
  motion.heading_guessed =
      guessed_heading(motion, Ad.row(5) * expected.covariance * Ad.row(5).transpose());
  T_world_camera_ = T_world_camera_ * step;
  velocity_ = step.log() / dt;
  const double gain = 1 - std::exp(-dt / options_.usual_time);
  if (motion.status == ScanMotion::Status::kTracked)
    usual_velocity_ += gain * (travel_aside(Ad * velocity_) - usual_velocity_);
  keep_key_frame(std::move(current), lost, motion);
  return motion;
}

Matrix6d DepthOdometry::covariance_of(const Alignment& a, const Expectation& expected,
                                      const SE3& T_prev_curr) const {
  Matrix6d covariance = (a.information + expected.information).ldlt().solve(Matrix6d::Identity());
  const double metres = T_prev_curr.translation().norm(), radians = T_prev_curr.so3().log().norm();
  const double t = options_.sigma_translation + options_.sigma_motion * metres;
  const double r = options_.sigma_rotation + options_.sigma_motion * radians;
  covariance.diagonal().head<3>().array() += t * t;
  covariance.diagonal().tail<3>().array() += r * r;
  return covariance;
}

// A person close by who is all that holds a direction takes the camera along.
bool DepthOdometry::doubts(const Expectation& expected, const SE3& T_prev_curr,
                           Timestamp stamp) const {
  if (!last_moving_ || stamp - *last_moving_ > options_.moved_memory) return false;
  const Vector6d off = (expected.T_prev_curr.inverse() * T_prev_curr).log();
  const double limit = options_.surprise_sigmas * options_.surprise_sigmas;
  return off.dot(expected.information * off) > limit;
}

double DepthOdometry::guessed_heading(const DepthMotion& motion, double expected_variance) {
  const double variance = motion.covariance(5, 5);
  if (variance < options_.heading_held * expected_variance) {
    turn_guessed_ = turn_variance_ = 0;
  } else {
    turn_guessed_ += std::abs(motion.T_prev_curr_body.so3().log().z());
    turn_variance_ += variance;
  }
  return turn_guessed_ + std::sqrt(turn_variance_);
}

double DepthOdometry::drop_what_moved(DepthBlocks& current, const SE3& T_world_camera) {
  if (keys_.empty()) return 0;
  KeyFrame& key = keys_.back();
  const SE3 T_key_current = key.T_world_camera.inverse() * T_world_camera;
  const auto come = moving_blocks(key.blocks, current, T_key_current);
  const auto gone = moving_blocks(current, key.blocks, T_key_current.inverse());
  return drop_blocks(current, come) + drop_blocks(key.blocks, gone);
}

void DepthOdometry::keep_key_frame(DepthBlocks blocks, bool lost, DepthMotion& motion) {
  if (lost) keys_.clear();
  if (!keys_.empty()) {
    const KeyFrame& key = keys_.back();
    const SE3 d = key.T_world_camera.inverse() * T_world_camera_;
    if (motion.matched > options_.key_overlap &&
        d.translation().norm() < options_.key_translation * key.median_depth &&
        d.so3().log().norm() < options_.key_rotation) {
      return;
    }
  }
  const double depth = median_depth(blocks);
  keys_.push_back({T_world_camera_, std::move(blocks), depth});
  if (static_cast<int>(keys_.size()) > options_.key_frames) keys_.pop_front();
  motion.key_frame = true;
}

}  // namespace lamina
