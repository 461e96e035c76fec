// Frame to key frames by projective point-to-plane Gauss-Newton.
#include <lamina/frontend/odometry/depth_odometry.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include <lamina/frontend/odometry/moving_blocks.hpp>

namespace lamina {
namespace {

struct Sums {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double squares = 0;
  double agreement = 0;  ///< sum of robust weights, 1 for a block that fits exactly
  double spurious = 0;   ///< information that noise of the normals makes in any direction
  int used = 0, tried = 0;
};

struct Gate {
  float distance, sigmas, beside, cosine, surface_variance;
};

/// Normal equations of one key frame for T_key_current (right tangent).
void accumulate(const DepthBlocks& key, const DepthBlocks& current, const SE3& T_key_current,
                int stride, const Gate& gate, Sums& sums) {
  const Eigen::Matrix3f R = T_key_current.so3().matrix().cast<float>();
  const Eigen::Vector3f t = T_key_current.translation().cast<float>();
  const auto fx = static_cast<float>(key.fx), fy = static_cast<float>(key.fy);
  const auto cx = static_cast<float>(key.cx + 0.5), cy = static_cast<float>(key.cy + 0.5);
  for (int v = 0; v < current.height; v += stride) {
    // Sums of a row in float, of rows in double: fast, and safe.
    Eigen::Matrix<float, 6, 6> H = Eigen::Matrix<float, 6, 6>::Zero();
    Eigen::Matrix<float, 6, 1> b = Eigen::Matrix<float, 6, 1>::Zero();
    float spurious = 0;
    for (int u = 0; u < current.width; u += stride) {
      const DepthBlock& c = current.at(u, v);
      if (!c.oriented()) continue;
      ++sums.tried;
      const Eigen::Vector3f q = R * c.point + t;
      if (q.z() < 0.1F) continue;
      const float fu = fx * q.x() / q.z() + cx, fv = fy * q.y() / q.z() + cy;
      if (!(fu >= 0 && fv >= 0 && fu < static_cast<float>(key.width) &&
            fv < static_cast<float>(key.height))) {
        continue;
      }
      const DepthBlock& k = key.at(static_cast<int>(fu), static_cast<int>(fv));
      if (!k.oriented()) continue;
      const Eigen::Vector3f n = R.transpose() * k.normal;
      if (n.dot(c.normal) < gate.cosine) continue;
      const float e = k.normal.dot(q - k.point);
      const float variance = c.sigma * c.sigma + k.sigma * k.sigma + gate.surface_variance;
      const float limit = std::max(gate.distance, gate.sigmas * std::sqrt(variance));
      if (std::abs(e) > limit || (q - k.point).squaredNorm() > gate.beside * q.z() * q.z())
        continue;
      // Geman-McClure-like: half weight at half the gate.
      const float r = e / (0.5F * limit), root = 1 + r * r;
      const float w = 1 / (variance * root * root);
      Eigen::Matrix<float, 6, 1> J;
      const Eigen::Vector3f m = c.point.cross(n);
      J << n.x(), n.y(), n.z(), m.x(), m.y(), m.z();
      H.noalias() += (w * J) * J.transpose();
      b -= (w * e) * J;
      sums.agreement += static_cast<double>(1 / (root * root));
      sums.squares += static_cast<double>(e * e);
      spurious += w * k.tilt * k.tilt;
      ++sums.used;
    }
    sums.H += H.cast<double>();
    sums.b += b.cast<double>();
    sums.spurious += static_cast<double>(spurious);
  }
}

double median_depth(const DepthBlocks& blocks) {
  std::vector<float> z;
  for (std::size_t i = 0; i < blocks.blocks.size(); i += 7) {
    if (blocks.blocks[i].valid()) z.push_back(blocks.blocks[i].point.z());
  }
  if (z.empty()) return 1;
  std::nth_element(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2), z.end());
  return static_cast<double>(z[z.size() / 2]);
}

/// Keeps what surfaces hold: H and b without directions below `limit`, angles brought to metres by
/// `lever`. Returns how many are missing.
int without_weak_directions(Matrix6d& H, Vector6d& b, double lever, double limit) {
  Vector6d unit;
  unit << 1, 1, 1, 1 / lever, 1 / lever, 1 / lever;
  const Matrix6d scaled = unit.asDiagonal() * H * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaled);
  Matrix6d kept = Matrix6d::Zero(), held = Matrix6d::Zero();
  int missing = 0;
  for (int i = 0; i < 6; ++i) {
    if (!(eigen.eigenvalues()(i) >= limit)) {
      ++missing;
      continue;
    }
    const Matrix6d direction =
        eigen.eigenvectors().col(i) * eigen.eigenvectors().col(i).transpose();
    held += direction;
    kept += eigen.eigenvalues()(i) * direction;
  }
  if (missing > 0) {
    const Vector6d back = unit.cwiseInverse();
    H = back.asDiagonal() * kept * back.asDiagonal();
    b = back.asDiagonal() * held * unit.asDiagonal() * b;
  }
  return missing;
}

}  // namespace

struct DepthOdometry::Alignment {
  SE3 T_world_camera;
  Matrix6d information = Matrix6d::Zero();  ///< of the image alone
  int unknown = 6;
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
    Sums sums;
    accumulate(key.blocks, current, key.T_world_camera.inverse() * T_world_camera, 6,
               {static_cast<float>(options_.fine_gate), 4, beside, 0.8F, surface_variance()}, sums);
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
  for (int i = 0, left = coarse_iterations; i < iterations; ++i, --left) {
    if (!fine && left <= 0) {
      fine = true;
      left = fine_iterations;
    }
    const double shrink = std::pow(0.6, i);
    const double distance =
        fine ? options_.fine_gate : std::max(options_.fine_gate, options_.coarse_gate * shrink);
    const Gate gate{static_cast<float>(distance), 4, 0.0625F,
                    static_cast<float>(options_.min_normal_cosine), surface_variance()};
    Sums s;
    for (const KeyFrame* key : keys) {
      accumulate(key->blocks, current, key->T_world_camera.inverse() * a.T_world_camera,
                 fine ? 1 : options_.coarse_stride, gate, s);
    }
    const double skipped = fine ? 1.0 : options_.coarse_stride * options_.coarse_stride;
    const double per_fact =
        std::max(1.0, options_.samples_per_fact / skipped) * static_cast<double>(keys.size());
    a.information = s.H / per_fact;
    Vector6d b = s.b / per_fact;
    a.unknown = without_weak_directions(
        a.information, b, keys.front()->median_depth,
        std::max(options_.min_information, options_.normal_noise_factor * s.spurious / per_fact));
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
}

double DepthOdometry::fit(const DepthBlocks& current, const SE3& T_world_camera) const {
  const KeyFrame& key = keys_.back();
  Sums sums;
  accumulate(
      key.blocks, current, key.T_world_camera.inverse() * T_world_camera, options_.coarse_stride,
      {0, 4, 0.0625F, static_cast<float>(options_.min_normal_cosine), surface_variance()}, sums);
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

// What moves by itself draws the coarse steps along. Unless they found clearly more than fine steps
// alone, these are believed.
void DepthOdometry::stay_near(const DepthBlocks& current, const SE3& predicted,
                              const Matrix6d& prior, Alignment& a) const {
  Alignment near;
  near.T_world_camera = predicted;
  align(current, predicted, prior, near, 0, options_.fine_iterations);
  if (fit(current, a.T_world_camera) < fit(current, near.T_world_camera) + options_.search_gain) {
    a = near;
  }
}

void DepthOdometry::search(const DepthBlocks& current, const Matrix6d& prior,
                           const std::vector<SE3>& starts, Alignment& a) const {
  double best = fit(current, a.T_world_camera) + options_.search_gain;
  std::optional<SE3> better;
  for (const SE3& start : starts) {
    Alignment tried;
    tried.T_world_camera = start;
    align(current, start, prior, tried, options_.coarse_iterations, 2);
    const double found = fit(current, tried.T_world_camera);
    if (found <= best) continue;
    best = found;
    better = start;
  }
  if (!better) return;
  // What surfaces leave open stays as this start has it.
  a.T_world_camera = *better;
  align(current, *better, prior, a, options_.coarse_iterations, options_.fine_iterations);
}

DepthMotion DepthOdometry::process(const DepthFrame& frame,
                                   const std::optional<MotionGuess>& guess) {
  DepthMotion motion;
  DepthBlocks current = depth_blocks(frame, options_.blocks);
  const SE3& T_body_camera = frame.camera.camera.T_body_camera;
  if (!last_stamp_) {
    last_stamp_ = frame.stamp;
    usual_.began(frame.stamp);
    keep_key_frame(std::move(current), true, motion);
    return motion;
  }
  const double dt = std::max(1e-4, frame.stamp - *last_stamp_);
  last_stamp_ = frame.stamp;
  // What is expected, and how sure that is.
  const double ratio = std::max(1.0, dt / options_.frame_time);
  SE3 step = SE3::exp(velocity_ * (dt <= options_.max_step ? dt : 0.0));
  Matrix6d expected = Matrix6d::Zero();
  expected.diagonal().head<3>().setConstant(std::pow(options_.sigma_velocity * ratio, 2));
  expected.diagonal().tail<3>().setConstant(std::pow(options_.sigma_turn * ratio, 2));
  if (guess) {
    step = T_body_camera.inverse() * guess->T_prev_curr_body * T_body_camera;
    const Matrix6d Ad = T_body_camera.inverse().adjoint();
    expected = Ad * guess->covariance * Ad.transpose();
    expected.diagonal().array() += 1e-9;
  }
  const Matrix6d prior = expected.ldlt().solve(Matrix6d::Identity());
  Alignment a;
  const SE3 predicted = T_world_camera_ * step;
  a.T_world_camera = predicted;
  align(current, predicted, prior, a, options_.coarse_iterations, options_.fine_iterations);
  if (a.matched < options_.search_matched) stay_near(current, predicted, prior, a);
  if (!guess && !keys_.empty() && (a.matched < options_.search_matched || a.unknown > 0)) {
    search(current, prior, other_starts(predicted, T_body_camera, options_.sigma_turn * ratio), a);
  }
  motion.moving = drop_what_moved(current, a.T_world_camera);
  if (motion.moving > 0) {
    a.T_world_camera = predicted;
    align(current, predicted, prior, a, options_.coarse_iterations, options_.fine_iterations);
  }
  const bool doubtful =
      !guess && usual_.gap_before(frame.stamp) && (a.unknown > 0 || usual_.worse(a.matched));
  const bool lost = doubtful || a.matched < options_.lost_matched || a.unknown == 6;
  const bool frozen = usual_.repeated(frame.raw);
  if (lost) {
    usual_.began(frame.stamp);
  } else if (!frozen) {
    usual_.tracked(frame.stamp, a.matched);
  }
  if (!lost) step = T_world_camera_.inverse() * a.T_world_camera;
  Matrix6d covariance = expected;
  if (!lost) {
    covariance = (a.information + prior).ldlt().solve(Matrix6d::Identity());
    const double t = options_.sigma_translation + options_.sigma_motion * step.translation().norm();
    const double r = options_.sigma_rotation + options_.sigma_motion * step.so3().log().norm();
    covariance.diagonal().head<3>().array() += t * t;
    covariance.diagonal().tail<3>().array() += r * r;
  }
  motion.status = lost            ? ScanMotion::Status::kPredicted
                  : a.unknown > 0 ? ScanMotion::Status::kDegenerate
                                  : ScanMotion::Status::kTracked;
  motion.unknown_directions = lost ? 6 : a.unknown;
  motion.matched = a.matched;
  motion.rms = a.rms;
  motion.T_prev_curr_body = T_body_camera * step * T_body_camera.inverse();
  const Matrix6d Ad = T_body_camera.adjoint();
  motion.covariance = Ad * covariance * Ad.transpose();
  motion.covariance = 0.5 * (motion.covariance + motion.covariance.transpose()).eval();
  motion.heading_guessed = guessed_heading(motion, Ad.row(5) * expected * Ad.row(5).transpose());
  T_world_camera_ = T_world_camera_ * step;
  velocity_ = step.log() / dt;
  keep_key_frame(std::move(current), lost, motion);
  return motion;
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
