// Frame to key frames by projective point-to-plane Gauss-Newton.
#include <lamina/frontend/motion/depth_odometry.hpp>

#include <Eigen/Cholesky>
#include <algorithm>

#include <lamina/frontend/motion/block_matching.hpp>
#include <lamina/frontend/motion/depth_odometry_parts.hpp>
#include <lamina/frontend/motion/moving_blocks.hpp>
#include <lamina/frontend/motion/travel.hpp>

namespace lamina {

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

// Ahead and in heading as before. Sideways and up to the usual velocity: who carries a camera along
// a wall and looks at it goes on, what sways comes back. Roll and pitch come to rest, or where
// surfaces leave them open a body that sways is turned over.
SE3 DepthOdometry::going_on(double dt, const SE3& T_body_camera) const {
  if (dt > options_.rest_time) return {};
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
  e.dt = dt;
  e.T_body_camera = T_body_camera;
  e.T_going_on = guess ? SE3::exp(dt * velocity_) : going_on(dt, T_body_camera);
  const double ratio = std::max(1.0, dt / options_.frame_time);
  if (guess) {
    e.T_prev_curr = T_body_camera.inverse() * guess->T_prev_curr_body * T_body_camera;
    const Matrix6d Ad = T_body_camera.inverse().adjoint();
    e.covariance = Ad * guess->covariance * Ad.transpose();
    e.covariance.diagonal().array() += 1e-9;
    e.by_wheels = true;
  } else {
    e.T_prev_curr = e.T_going_on;
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

namespace {

template <class Alignment>
void report_match(const Alignment& a, bool lost, DepthMotion& motion) {
  motion.status = lost            ? ScanMotion::Status::kPredicted
                  : a.unknown > 0 ? ScanMotion::Status::kDegenerate
                                  : ScanMotion::Status::kTracked;
  motion.unknown_directions = lost ? 6 : a.unknown;
  motion.matched = a.matched;
  motion.rms = a.rms;
}

// What the image alone says, in the body's tangent. `Ad_camera_body`: from there to the camera's.
template <class Alignment>
void report_image(const Alignment& a, const Matrix6d& Ad_camera_body, DepthMotion& motion) {
  motion.image_information = Ad_camera_body.transpose() * a.information * Ad_camera_body;
  motion.image_pull = Ad_camera_body.transpose() * a.pull;
}

void report_overruled(const SE3& by_wheels, const SE3& by_image, DepthMotion& motion) {
  const SE3 T_wheels_image = by_wheels.inverse() * by_image;
  motion.against_wheels_m = T_wheels_image.translation().norm();
  motion.against_wheels_rad = T_wheels_image.so3().log().norm();
}

// A camera's covariance in the body's tangent. `Ad`: of T_body_camera.
Matrix6d in_body(const Matrix6d& covariance, const Matrix6d& Ad) {
  const Matrix6d turned = Ad * covariance * Ad.transpose();
  return 0.5 * (turned + turned.transpose());
}

// Of an image that says nothing.
template <class Expectation>
DepthMotion as_expected(const Expectation& e, const SE3& T_body_camera) {
  DepthMotion motion;
  motion.status = ScanMotion::Status::kPredicted;
  motion.unknown_directions = 6;
  motion.T_prev_curr_body = T_body_camera * e.T_prev_curr * T_body_camera.inverse();
  motion.covariance = in_body(e.covariance, T_body_camera.adjoint());
  return motion;
}

bool moves(const MotionGuess& guess) {
  constexpr double kClear = 22.5;  // 6 dof, 0.1 %
  const Vector6d e = guess.T_prev_curr_body.log();
  const Matrix6d least = 1e-8 * Matrix6d::Identity();  // a standstill's covariance may be zero
  return e.dot((guess.covariance + least).ldlt().solve(e)) > kClear;
}

// Nothing is in an image, or it is the last one to the bit while wheels drive: it was not taken
// here, and what was seen before is what the next one is laid on.
bool tells_nothing(const DepthBlocks& image, bool frozen, const MotionGuess& guess) {
  return !image.any_oriented() || (frozen && moves(guess));
}

}  // namespace

DepthMotion DepthOdometry::process(const DepthFrame& frame,
                                   const std::optional<MotionGuess>& guess) {
  DepthMotion motion;
  DepthBlocks current = depth_blocks(frame, options_.blocks);
  const bool frozen = usual_.repeated(frame.raw);
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
  if (guess && tells_nothing(current, frozen, *guess)) {
    T_world_camera_ = T_world_camera_ * at_first.T_prev_curr;
    return as_expected(at_first, T_body_camera);
  }
  Expectation expected = at_first;
  Alignment a = locate(current, T_body_camera, expected);
  motion.explained = explains(current, a.T_world_camera);
  motion.moving = drop_what_moved(current, a.T_world_camera);
  // With what is left, other starts and places along open directions are not believed again: a
  // person who walked by made a map 0.17 m off of it, and nothing said so.
  if (motion.moving > 0) {
    const bool overruled = expected.overruled;
    expected = at_first;
    a = aligned_as_expected(current, expected);
    if (overruled) overrule(current, expected, a);
    last_moving_ = frame.stamp;
  }
  const bool unlike =
      !guess && usual_.gap_before(frame.stamp) && (a.unknown > 0 || usual_.worse(a.matched));
  const bool lost = unlike || a.matched < options_.lost_matched || a.unknown == 6;
  if (lost)
    usual_.began(frame.stamp);
  else if (!frozen)
    usual_.tracked(frame.stamp, a.matched);
  report_match(a, lost, motion);
  const SE3 step = lost ? expected.T_prev_curr : T_world_camera_.inverse() * a.T_world_camera;
  motion.T_prev_curr_body = T_body_camera * step * T_body_camera.inverse();
  if (!lost && expected.left_wheels()) report_overruled(at_first.T_prev_curr, step, motion);
  motion.doubtful = !lost && contradictions(expected, step, frame.stamp);
  Matrix6d covariance = lost ? expected.covariance : covariance_of(a, expected, step);
  if (motion.doubtful) covariance += expected.covariance;
  const Matrix6d Ad = T_body_camera.adjoint();
  motion.covariance = in_body(covariance, Ad);
  if (!lost) report_image(a, T_body_camera.inverse().adjoint(), motion);
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
bool DepthOdometry::contradictions(const Expectation& expected, const SE3& T_prev_curr,
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
