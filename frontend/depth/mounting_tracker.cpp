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
constexpr double kGate = 16;  // chi-squared of an innovation that is set aside

Eigen::Matrix3d measurement_noise(const Eigen::Matrix3d& covariance) {
  // The two tilts of the plane's tangent are about axes in the floor: those of body up to heading.
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  const double tilt = covariance.topLeftCorner<2, 2>().trace();
  R(0, 0) = R(1, 1) = tilt + kModelTilt * kModelTilt;
  R(2, 2) = covariance(2, 2) + kModelHeight * kModelHeight;
  return R;
}

// How level one place of the ground is, before its unevenness was observed.
Eigen::Vector3d one_place() {
  const Eigen::Vector3d sigma(0.2 * kDegree, 0.2 * kDegree, 0.01);  // roll, pitch (rad), height (m)
  return sigma.cwiseAbs2();
}

}  // namespace

MountingTracker::MountingTracker(const FloorOptions& options)
    : options_(options), ground_(one_place()), lag_one_(one_place()) {}

void MountingTracker::expect_ground(const Leveling& sigma) {
  const Eigen::Vector3d seen(sigma.roll, sigma.pitch, sigma.height);
  if ((seen.cwiseAbs2().array() <= one_place().array()).all()) return;
  ground_ = lag_one_ = one_place().cwiseMax(seen.cwiseAbs2());
  ground_frames_ = options_.ground_frames;
}

void MountingTracker::begin(const SE3& T_calibrated, const Leveling& mounting) {
  state_ = {mounting.roll, mounting.pitch, mounting.height};
  begun_ = state_;
  P_ = one_place().asDiagonal();
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
    P_ = R + Eigen::Matrix3d(ground_.asDiagonal());
    reported_ = Eigen::Vector3d(0, 0, T_calibrated.translation().z());
    estimate_.frames = 1;
    publish(T_calibrated);
    return;
  }
  const double tilt_walk = options_.process_deg * kDegree;
  P_.diagonal() += Eigen::Vector3d(tilt_walk * tilt_walk, tilt_walk * tilt_walk,
                                   options_.process_height_m * options_.process_height_m);
  const Eigen::Vector3d innovation = measured - state_;
  const Eigen::Matrix3d S = P_ + R + Eigen::Matrix3d(ground_.asDiagonal());
  if (innovation.dot(S.inverse() * innovation) > kGate) {
    set_aside(measured, R);
  } else {
    aside_.clear();
    const Eigen::Vector3d ground = observe_ground(innovation, (P_ + R).diagonal());
    const double share = options_.facing_share * options_.facing_share;
    P_.diagonal() = P_.diagonal().cwiseMax(ground / estimate_.frames).cwiseMax(share * ground_);
    const Eigen::Matrix3d K = P_ * (P_ + R + Eigen::Matrix3d(ground.asDiagonal())).inverse();
    state_ += K * innovation;
    P_ = (Eigen::Matrix3d::Identity() - K) * P_;
  }
  ++estimate_.frames;
  publish(T_calibrated);
}

// An innovation beyond the gate counts as one at the gate: a wrong floor does not open it at once.
// Returns the variance that as many independent measurements would have: of a first-order
// autoregression with coefficient c, n measurements are worth n (1 - c) / (1 + c).
Eigen::Vector3d MountingTracker::observe_ground(const Eigen::Vector3d& innovation,
                                                const Eigen::Vector3d& expected) {
  const double share = 1 / std::min(ground_frames_ + estimate_.frames, options_.ground_frames);
  const Eigen::Vector3d most = (kGate * (expected + ground_)).cwiseSqrt();
  const Eigen::Vector3d bounded = innovation.cwiseMin(most).cwiseMax(-most);
  ground_ = (ground_ + share * (bounded.cwiseAbs2() - expected - ground_)).cwiseMax(0);
  lag_one_ += share * (bounded.cwiseProduct(previous_) - lag_one_);
  previous_ = bounded;
  const Eigen::Array3d c =
      (lag_one_.array() / (ground_ + expected).array()).cwiseMax(0).cwiseMin(0.99);
  return ground_.array() * (1 + c) / (1 - c);
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
  if (aside_.size() > wanted) aside_.pop_front();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& m : aside_) mean += m / static_cast<double>(aside_.size());
  const auto near_mean = [&](const Eigen::Vector3d& m) {
    return (m - mean).head<2>().norm() < 4 * std::sqrt(R(0, 0) + R(1, 1));
  };
  if (!std::all_of(aside_.begin(), aside_.end(), near_mean)) {
    observe_ground(measured - state_, (P_ + R).diagonal());
    return;
  }
  const auto knocked = [&](const Eigen::Vector3d& m) {
    return is_knock(m) && std::abs(m.z() - mean.z()) < 4 * std::sqrt(R(2, 2));
  };
  if (aside_.size() == wanted && knocks_accepted_ &&
      std::all_of(aside_.begin(), aside_.end(), knocked)) {
    state_ = mean;
    P_ = R;
    aside_.clear();
  }
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
  const Eigen::Vector3d stated =
      begun_.value_or(Eigen::Vector3d(0, 0, T_calibrated.translation().z()));
  const Eigen::Vector3d off = state_ - stated;
  const bool contradicted = off.dot(P_.inverse() * off) > options_.mounting_gate;
  const Eigen::Vector3d used = contradicted ? state_ : stated;
  estimate_.roll = used(0);
  estimate_.pitch = used(1);
  estimate_.height = used(2);
  estimate_.T_body_camera = apply({used(0), used(1), used(2)}, T_calibrated);
  Eigen::Matrix3d swap = Eigen::Matrix3d::Zero();
  swap(0, 1) = swap(1, 0) = swap(2, 2) = 1;
  estimate_.covariance = swap * P_ * swap;
  const double uneven = options_.max_unevenness_deg * kDegree;
  estimate_.rigid = ground_.head<2>().maxCoeff() < uneven * uneven;
  const double moved = (used - reported_).head<2>().norm();
  estimate_.changed = moved > options_.report_change_deg * kDegree;
  if (estimate_.changed) reported_ = used;
}

}  // namespace lamina
