// Filter of the mounting.
#include <lamina/frontend/depth/mounting_tracker.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
// What a frame's floor is wrong by beyond its noise: lens and disparity distortion.
constexpr double kModelTilt = 0.04 * kDegree;
constexpr double kModelHeight = 0.002;

Eigen::Matrix3d measurement_noise(const Eigen::Matrix3d& covariance) {
  // The two tilts of the plane's tangent are about axes in the floor: those of body up to heading.
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  const double tilt = covariance.topLeftCorner<2, 2>().trace();
  R(0, 0) = R(1, 1) = tilt + kModelTilt * kModelTilt;
  R(2, 2) = covariance(2, 2) + kModelHeight * kModelHeight;
  return R;
}

}  // namespace

void MountingTracker::begin(const SE3& T_calibrated, const Leveling& mounting) {
  constexpr double kTilt = 0.2 * kDegree, kHeight = 0.01;  // 1-sigma: ground is no better a level
  state_ = {mounting.roll, mounting.pitch, mounting.height};
  P_ = Eigen::Vector3d(kTilt, kTilt, kHeight).cwiseAbs2().asDiagonal();
  reported_ = state_;
  estimate_.frames = 1;
  publish(T_calibrated);
}

void MountingTracker::update(const SE3& T_calibrated, const Plane& floor_camera,
                             const Eigen::Matrix3d& covariance) {
  const Leveling l = leveling_of(T_calibrated, floor_camera);
  const Eigen::Vector3d measured(l.roll, l.pitch, l.height);
  const Eigen::Matrix3d R = measurement_noise(covariance);
  if (estimate_.frames == 0) {
    state_ = measured;
    P_ = R;
    reported_ = Eigen::Vector3d(0, 0, T_calibrated.translation().z());
    estimate_.frames = 1;
    publish(T_calibrated);
    return;
  }
  const double tilt_walk = options_.process_deg * kDegree;
  P_.diagonal() += Eigen::Vector3d(tilt_walk * tilt_walk, tilt_walk * tilt_walk,
                                   options_.process_height_m * options_.process_height_m);
  const Eigen::Vector3d innovation = measured - state_;
  const Eigen::Matrix3d S_inverse = (P_ + R).inverse();
  if (innovation.dot(S_inverse * innovation) > 16) {
    set_aside(measured, R);
  } else {
    const Eigen::Matrix3d K = P_ * S_inverse;
    state_ += K * innovation;
    P_ = (Eigen::Matrix3d::Identity() - K) * P_;
    aside_.clear();
    erratic_ = std::max(0, erratic_ - 1);
  }
  ++estimate_.frames;
  publish(T_calibrated);
}

// A knock turns a camera about its own place. Ground that rises or falls ahead passes the body at
// another height, and at ever another one while it is driven to.
bool MountingTracker::is_knock(const Eigen::Vector3d& measured) const {
  constexpr double kMoved = 0.01;  // m
  return std::abs(measured.z() - state_.z()) < kMoved;
}

void MountingTracker::set_aside(const Eigen::Vector3d& measured, const Eigen::Matrix3d& R) {
  const std::size_t wanted = static_cast<std::size_t>(std::max(1, options_.confirm_frames));
  aside_.push_back(measured);
  if (aside_.size() < wanted) return;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& m : aside_) mean += m;
  mean /= static_cast<double>(aside_.size());
  bool agree = true;
  for (const auto& m : aside_) {
    agree &= (m - mean).head<2>().norm() < 4 * std::sqrt(R(0, 0) + R(1, 1)) &&
             std::abs(m.z() - mean.z()) < 4 * std::sqrt(R(2, 2));
  }
  const bool knock =
      knocks_accepted_ && std::all_of(aside_.begin(), aside_.end(),
                                      [this](const Eigen::Vector3d& m) { return is_knock(m); });
  if (agree && knock) {
    state_ = mean;
    P_ = R;
    aside_.clear();
    return;
  }
  aside_.pop_front();
  if (!agree) erratic_ = std::min(erratic_ + 1, 2 * options_.confirm_frames);
}

void MountingTracker::skip(const SE3& T_calibrated) {
  aside_.clear();
  if (estimate_.frames == 0) {
    estimate_.T_body_camera = T_calibrated;
    estimate_.height = T_calibrated.translation().z();
  }
  estimate_.changed = false;
}

void MountingTracker::publish(const SE3& T_calibrated) {
  estimate_.roll = state_(0);
  estimate_.pitch = state_(1);
  estimate_.height = state_(2);
  estimate_.T_body_camera = apply({state_(0), state_(1), state_(2)}, T_calibrated);
  Eigen::Matrix3d swap = Eigen::Matrix3d::Zero();
  swap(0, 1) = swap(1, 0) = swap(2, 2) = 1;
  estimate_.covariance = swap * P_ * swap;
  estimate_.rigid = erratic_ < options_.confirm_frames;
  const double moved = (state_ - reported_).head<2>().norm();
  estimate_.changed = moved > options_.report_change_deg * kDegree;
  if (estimate_.changed) reported_ = state_;
}

}  // namespace lamina
