// The chain of motions, what wheels tell of them, and what is left where nothing does.
#include <lamina/frontend/motion/motion_estimator.hpp>

#include <algorithm>

#include <lamina/frontend/motion/motion_covariances.hpp>
#include <lamina/frontend/motion/out_of_plane_motion.hpp>

namespace lamina {
namespace {

constexpr double kSurelyCoasted = 1;  // s: after that a robot that nothing tracks is lost

// Images contradict wheels that slip; beside them scans gain nothing by a kernel over the wheels.
ScanOdometryOptions scan_odometry_of(ScanOdometryOptions scans, const Calibration& calibration) {
  scans.robust_wheels = !calibration.depth_camera && !calibration.stereo_camera;
  return scans;
}

}  // namespace

MotionEstimator::MotionEstimator(const MotionOptions& options, const Calibration& calibration)
    : planar_(calibration.odometry.planar),
      max_tilt_(options.scan_odometry.max_tilt),
      wheels_(calibration.odometry, options.calibrate_wheels),
      duration_(options.sweep),
      scan_odometry_(scan_odometry_of(options.scan_odometry, calibration)) {}

void MotionEstimator::look_by_scans(const MotionEstimator& other) {
  level_scanner_ = other.level_scanner_;
  duration_.set(other.duration_.seconds());
  wheels_.use_whole(other.wheels_.whole());
  scans_tell_scale_ = true;
}

// A scan asks back to the last scan, an image to the last step.
bool MotionEstimator::begin(Timestamp stamp) {
  if (last_step_ && stamp < *last_step_) return false;
  wheels_.meet(stamp, scan_.stamp ? scan_.stamp : last_step_);
  return true;
}

// --------------------------------------------------------------------------- the chain

Increment MotionEstimator::advance(const SE3& T_start_body, const Matrix6d& covariance,
                                   Timestamp stamp) {
  Increment increment{T_start_body_.inverse() * T_start_body, covariance};
  if (follow_slopes_ && slopes_.of_late(stamp) && !scan_.stamp) increment = tilting(increment);
  const Matrix6d J = increment.T_from_to.inverse().adjoint();
  image_.since = J * image_.since * J.transpose() + increment.covariance;
  T_start_body_ = T_start_body;
  if (!first_step_) first_step_ = T_start_body;
  last_step_ = stamp;
  if (!last_observed_) last_observed_ = stamp;
  wheels_.placed(stamp, T_start_body_, increment);
  return increment;
}

void MotionEstimator::place(Timestamp stamp, const Increment& moved, Step& step) {
  if (step.motion_known && !step.tracking_lost) {
    last_observed_ = stamp;
    const double dt = last_step_ ? stamp - *last_step_ : 0;
    if (dt > 0) image_.velocity = moved.T_from_to.log() / dt;
  }
  if (scan_.stamp) {
    const Matrix6d J = moved.T_from_to.inverse().adjoint();
    const Matrix6d before = scan_.since.value_or(Matrix6d::Zero());
    scan_.since = J * before * J.transpose() + moved.covariance;
  }
  step.motion = advance(T_start_body_ * moved.T_from_to, moved.covariance, stamp);
  step.T_start_body = T_start_body_;
  step.observations.first_floor_map = first_floor_map();
}

// Where up is at the start: along the body, unless that is known to stand tilted.
Eigen::Vector3d MotionEstimator::up_map() const {
  const SO3& R = first_step_->so3();
  return (T_level_start_ ? R * T_level_start_->so3().inverse() : R) * Eigen::Vector3d::UnitZ();
}

// Where up is: as the chain of motions has it, once it has left the plane.
void MotionEstimator::point_up(Step& step) {
  ever_lifted_ = ever_lifted_ || scan_.lifted.has_value();
  if (!ever_lifted_) return;
  step.observations.up_body = T_start_body_.so3().inverse() * up_map();
}

// A body on wheels stands on it; one whose scanner is all that tells its motion is taken to move
// level, too. A single image that gave the first pose is not good enough.
std::optional<Plane> MotionEstimator::first_floor_map() {
  if (!first_floor_map_ && first_step_ && (wheels_.met() ? planar_ : scan_.stamp.has_value())) {
    const SE3 T_map_start =
        T_level_start_ ? *first_step_ * T_level_start_->inverse() : *first_step_;
    first_floor_map_ = Plane(up_map(), up_map().dot(T_map_start.translation()));
  }
  return first_floor_map_;
}

bool MotionEstimator::at_tilted_start() const {
  constexpr double kOff = 1;  // m
  return T_level_start_ &&
         (!first_step_ || (first_step_->inverse() * T_start_body_).translation().norm() < kOff);
}

// --------------------------------------------------------------------------- wheels

// Logs without odometry often hold one of zeros: wheels that never moved are no longer asked once
// scans tell of a way.
std::optional<Increment> MotionEstimator::measured_by_wheels(const std::optional<Timestamp>& from,
                                                             Timestamp to) const {
  if (scan_.stamp && !wheels_.track().moved()) {
    constexpr double kWay = 0.2;  // m, or rad
    const SE3 way = first_step_->inverse() * scan_.T_start_body;
    if (way.translation().norm() > kWay || way.so3().log().norm() > kWay) return std::nullopt;
  }
  return from ? wheels_.track().between(*from, to) : std::nullopt;
}

std::optional<Increment> MotionEstimator::by_wheels(Timestamp stamp, Step& step) const {
  std::optional<Increment> moved = wheels_.corrected(measured_by_wheels(last_step_, stamp));
  if (!moved && (moved = wheels_.across_hole(T_start_body_, stamp)))
    step.across_hole = wheels_.steps_in_hole();
  if (moved && scanned_of_late(stamp)) step.left_to_wheels = scan_.left_to_wheels;
  return moved;
}

// Where the chain of motions stands at a stamp by wheels alone. The map frame is the odometry
// frame: the first pose is the first odometry pose, also where that comes a little later.
SE3 MotionEstimator::dead_reckoned(Timestamp stamp) const {
  const WheelTrack& track = wheels_.track();
  if (!last_step_) {
    const SE3 T = track.at(stamp).value_or(track.empty() ? SE3() : track.oldest());
    return T_level_start_ ? T * *T_level_start_ : T;
  }
  const auto moved = track.between(*last_step_, stamp);
  return moved ? T_start_body_ * moved->T_from_to : T_start_body_;
}

// --------------------------------------------------------------------------- nothing

// Nothing tells at this instant: on as the wheels drove before they stopped, as between the last
// two scans or over the last two images, the less sure the longer.
Increment MotionEstimator::coast(Timestamp stamp) const {
  constexpr double kSurest = 1e-4, kShare = 0.5, kAcceleration = 1, kTurning = 2;  // m, rad, s
  if (!last_step_) return {T_start_body_.inverse() * dead_reckoned(stamp), still_covariance()};
  const double dt = stamp - *last_step_;
  if (!(stamp - last_observed_.value_or(*last_step_) < kSurelyCoasted))
    return {SE3(), any_motion()};  // long enough to have gone anywhere
  std::optional<Vector6d> velocity = wheels_.track().velocity(*last_step_, stamp);
  if (!velocity) velocity = last_scan_velocity();
  if (!velocity) velocity = image_.velocity;
  if (!velocity) return {SE3(), still_covariance(dt)};
  const Vector6d moved = dt * *velocity;
  const double along = kSurest + kShare * moved.head<3>().norm() + 0.5 * kAcceleration * dt * dt;
  const double about = kSurest + kShare * moved.tail<3>().norm() + 0.5 * kTurning * dt * dt;
  return {SE3::exp(moved), round_covariance(along, about)};
}

// coast(), with what the step must say of it.
Increment MotionEstimator::coasted(Timestamp stamp, Step& step) const {
  step.motion_known = !last_step_;
  step.tracking_lost = last_observed_ && !(stamp - *last_observed_ < kSurelyCoasted);
  Increment on = coast(stamp);
  if (scan_.stamp && !step.tracking_lost) on.covariance = held_to_floor(on.covariance);
  return on;
}

// Wheels on a floor that no camera sees: a level scanner cannot tell height, roll and pitch, and
// over thousands of steps even a small freedom in them is used up by wrong matches.
Matrix6d MotionEstimator::held_level(Matrix6d covariance) const {
  if (!planar_ || ground_seen_) return covariance;
  constexpr double kHeight = 1e-4, kLevel = 1e-5;  // m and rad a step
  for (const int k : {2, 3, 4}) {
    covariance.row(k).setZero();
    covariance.col(k).setZero();
    const double sigma = k == 2 ? kHeight : kLevel;
    covariance(k, k) = sigma * sigma;
  }
  return covariance;
}

// Between scans that tell the motion a body stays as level as from one of them to the next. Planes
// that an image sees before there is a floor to hold them would tilt it else.
Matrix6d MotionEstimator::held_to_floor(Matrix6d covariance) const {
  if (!planar_) return covariance;
  const ScanOdometryOptions& options = scan_odometry_.options();
  for (const int k : {2, 3, 4}) {
    const double sigma = k == 2 ? options.sigma_height : options.sigma_level;
    covariance(k, k) = std::min(covariance(k, k), sigma * sigma);
  }
  return covariance;
}

}  // namespace lamina
