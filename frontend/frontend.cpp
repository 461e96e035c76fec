// Routing and dead reckoning.
#include <lamina/frontend/frontend.hpp>

#include <algorithm>
#include <utility>

#include <lamina/frontend/motion/motion_covariances.hpp>

namespace lamina {
namespace {

// Tracks are predicted with the wheels' own uncertainty.
TrackingOptions tracking_of(const FrontEndOptions& settings, const Calibration& calibration) {
  TrackingOptions tracking = settings.tracking;
  tracking.odometry = calibration.odometry;
  return tracking;
}

// The floor tells how a camera is mounted on a body that stands on it. One that flies or is carried
// tilts: what tilts with it is no mounting.
FloorOptions floor_options(const FrontEndOptions& settings, bool planar) {
  FloorOptions options = settings.floor;
  options.self_calibrate = options.self_calibrate && planar;
  return options;
}

}  // namespace

SE3 levelled_pose(const Plane& floor_body) {
  const SO3 level(
      Eigen::Quaterniond::FromTwoVectors(floor_body.normal(), Eigen::Vector3d::UnitZ()));
  const SO3 R = SO3::rot_z(-level.yaw()) * level;
  return SE3(R, {0, 0, -floor_body.rho()});
}

namespace {

// Images contradict wheels that slip; beside them scans gain nothing by a kernel over the wheels.
ScanOdometryOptions scan_odometry_of(const FrontEndOptions& settings,
                                     const Calibration& calibration) {
  ScanOdometryOptions options = settings.scan_odometry;
  options.robust_wheels = !calibration.depth_camera && !calibration.stereo_camera;
  return options;
}

}  // namespace

FrontEnd::FrontEnd(const FrontEndOptions& settings, const Calibration& calibration)
    : planar_(calibration.odometry.planar),
      wheels_(calibration.odometry),
      wheels_ahead_(calibration.odometry),
      learned_(settings.calibrate_wheels),
      floor_(floor_options(settings, planar_)),
      obstacles_(scan_options(settings)),
      segments_(settings.segments, tracking_of(settings, calibration)),
      scan_odometry_(scan_odometry_of(settings, calibration)),
      max_tilt_(settings.scan_odometry.max_tilt),
      sweep_(settings.sweep) {}

void FrontEnd::begin_tilted(const TiltedStart& start) {
  floor_.begin(start.T_body_camera, start.usual);
  T_level_start_ = start.T_level_body();
}

std::optional<Step> FrontEnd::process(const Measurement& measurement, Diagnostics& metrics) {
  if (const auto* odometry = std::get_if<Odometry>(&measurement)) {
    if (!without_wheels_) wheels_.add(*odometry);
    return std::nullopt;
  }
  if (const auto* scan = std::get_if<LaserScan>(&measurement)) {
    return process_scan(as_noisy_as_it_is(*scan), metrics);
  }
  if (const auto* depth = std::get_if<DepthFrame>(&measurement)) {
    if (distortion_.empty()) return process_depth(*depth, SensorKind::kDepth, metrics);
    DepthFrame frame = *depth;
    distortion_.correct(frame);
    return process_depth(frame, SensorKind::kDepth, metrics);
  }
  if (const auto* pair = std::get_if<StereoFrame>(&measurement)) {
    const DepthFrame frame = [&] {
      const auto timer = metrics.time("stereo");
      return depth_from_stereo(*pair);
    }();
    return process_depth(frame, SensorKind::kStereo, metrics);
  }
  if (const auto* cloud = std::get_if<CloudFrame>(&measurement)) {
    return process_cloud(*cloud, metrics);
  }
  return std::nullopt;
}

// False where the stamp goes back. Odometry that ends before the first frame, or begins after the
// last, is none.
bool FrontEnd::meet(Timestamp stamp) {
  if (last_step_ && stamp < *last_step_) {
    ++skipped_["stamp goes back"];
    return false;
  }
  wheels_met_ = wheels_met_ || wheels_.at(stamp).has_value();
  // A scan asks back to the last scan, an image to the last step.
  auto from = last_scan_ ? last_scan_ : last_step_;
  if (from && met_last_) from = std::min(*from, met_last_->stamp);
  if (from) wheels_.forget_before(*from);
  return true;
}

// Where up is at the start: along the body, unless that is known to stand tilted.
Eigen::Vector3d FrontEnd::up_map() const {
  const SO3& R = first_step_->so3();
  return (T_level_start_ ? R * T_level_start_->so3().inverse() : R) * Eigen::Vector3d::UnitZ();
}

// A body on wheels stands on it; one whose scanner is all that tells its motion is taken to move
// level, too. A single image that gave the first pose is not good enough.
std::optional<Plane> FrontEnd::first_floor_map() {
  if (!first_floor_map_ && first_step_ && (wheels_met_ ? planar_ : last_scan_.has_value())) {
    const SE3 T_map_start =
        T_level_start_ ? *first_step_ * T_level_start_->inverse() : *first_step_;
    first_floor_map_ = Plane(up_map(), up_map().dot(T_map_start.translation()));
  }
  return first_floor_map_;
}

// Wheels on a floor that no camera sees: a level scanner cannot tell height, roll and pitch, and
// over thousands of steps even a small freedom in them is used up by wrong matches.
Matrix6d FrontEnd::held_level(Matrix6d covariance) const {
  if (!planar_ || depth_seen_) return covariance;
  constexpr double kHeight = 1e-4, kLevel = 1e-5;  // m and rad a step
  for (const int k : {2, 3, 4}) {
    covariance.row(k).setZero();
    covariance.col(k).setZero();
    const double sigma = k == 2 ? kHeight : kLevel;
    covariance(k, k) = sigma * sigma;
  }
  return covariance;
}

Increment FrontEnd::advance(const SE3& T_start_body, const Matrix6d& covariance, Timestamp stamp) {
  Increment increment{T_start_body_.inverse() * T_start_body, covariance};
  if (follow_slopes_ && slopes_of_late(stamp) && !last_scan_) increment = tilting(increment);
  const Matrix6d J = increment.T_from_to.inverse().adjoint();
  since_image_ = J * since_image_ * J.transpose() + increment.covariance;
  T_start_body_ = T_start_body;
  if (!first_step_) first_step_ = T_start_body;
  last_step_ = stamp;
  if (!last_observed_) last_observed_ = stamp;
  note_met(stamp, increment);
  return increment;
}

std::optional<Step> FrontEnd::process_depth(const DepthFrame& frame, SensorKind kind,
                                            Diagnostics& metrics) {
  if (!meet(frame.stamp)) return std::nullopt;
  depth_seen_ = true;
  Step step;
  std::optional<Increment> moved = driven(last_step_, frame.stamp);
  if (!moved && (moved = across_hole(T_start_body_, frame.stamp))) {
    step.across_hole = met_last_->steps;
  }
  if (moved && scanned_of_late(frame.stamp)) step.left_to_wheels = scan_left_;
  FloorResult floor;
  {
    const auto timer = metrics.time("floor");
    floor_.accept_knocks(may_be_knocked(frame.stamp));
    floor = floor_.process(frame);
    floor.sensor = kind;
    floors_.add(frame, floor);
    optical_.add(floor, frame.camera.camera.T_body_camera);
    const bool ideal = frame.camera.noise.kind == DepthNoise::Kind::kIdeal;
    depth_noise_.add(floor.noise_scale / (ideal ? raised_by_rounding(frame) : 1));
    metrics.counts.depth_noise_over_calibration = depth_noise_.median();
    look_for_slopes(floor);
    step.observations = floor.to_observations();
  }
  {
    const auto timer = metrics.time("obstacles");
    step.obstacles = obstacles_.process(frame, floor, floor_.disparities());
  }
  if (!floor.look.empty()) step.ground = std::move(floor.look);
  if (!last_sight_ || frame.stamp - *last_sight_ >= kLookInterval) {
    if (DepthLook look = depth_look(frame); !look.empty()) {
      step.sight = std::move(look);
      last_sight_ = frame.stamp;
    }
  }
  if (!wheels_met_ && !last_scan_) {
    moved = move_by_depth(frame, floor, step, metrics);
  } else if (!moved) {
    moved = bridge(frame, step, metrics);
  } else if (images_beside_wheels_ && !last_scan_) {
    moved = beside_wheels(frame, step, *moved, metrics);
  }
  keep_slopes_in_mind(frame.stamp, *moved);
  place(step, floor, off_plane(frame, step, *moved, metrics));
  point_up(step);
  step.slopes = slopes_of_late(frame.stamp);
  last_image_ = frame.stamp;
  T_start_image_ = T_start_body_;
  since_image_.setZero();
  return step;
}

void FrontEnd::place(Step& step, const FloorResult& floor, const Increment& moved) {
  if (step.motion_known && !step.tracking_lost) {
    last_observed_ = floor.stamp;
    const double dt = last_step_ ? floor.stamp - *last_step_ : 0;
    if (dt > 0) image_velocity_ = moved.T_from_to.log() / dt;
  }
  if (last_scan_) {
    const Matrix6d J = moved.T_from_to.inverse().adjoint();
    const Matrix6d before = since_scan_.value_or(Matrix6d::Zero());
    since_scan_ = J * before * J.transpose() + moved.covariance;
  }
  step.motion = advance(T_start_body_ * moved.T_from_to, moved.covariance, floor.stamp);
  step.T_start_body = T_start_body_;
  step.observations.first_floor_map = first_floor_map();
  // What the floor front-end says in the frame levelled by this image's floor, in that of the body.
  step.T_body_levelled = step.observations.T_body_sensor * floor.T_body_camera.inverse();
  for (Surfel& surfel : step.observations.surfels_body) {
    surfel = surfel.transformed(step.T_body_levelled);
  }
  for (Eigen::Vector3d& point : step.observations.obstacle_points_body) {
    point = step.T_body_levelled * point;
  }
}

// Clouds say what planes there are; how the body moved is the wheels' or scans' to say.
std::optional<Step> FrontEnd::process_cloud(const CloudFrame& cloud, Diagnostics& metrics) {
  if (cloud.points_sensor.empty()) {
    ++skipped_["cloud without points"];
    return std::nullopt;
  }
  if (!meet(cloud.stamp)) return std::nullopt;
  depth_seen_ = true;
  Step step;
  std::optional<Increment> moved = driven(last_step_, cloud.stamp);
  if (moved && scanned_of_late(cloud.stamp)) step.left_to_wheels = scan_left_;
  const auto timer = metrics.time("floor");
  const FloorResult floor = floor_.process(cloud);
  step.observations = floor.to_observations();
  if (!moved) moved = coasted(cloud.stamp, step);
  if (!last_step_ && !wheels_met_ && floor.floor_camera) {
    levelled_by_image_ = true;
    moved->T_from_to = levelled_pose(cloud.T_body_sensor * *floor.floor_camera);
  }
  place(step, floor, *moved);
  return step;
}

SkippedCounts FrontEnd::skipped() const {
  SkippedCounts all = skipped_;
  for (const auto& [why, count] : segments_.skipped()) all["scan: " + why] += count;
  return all;
}

}  // namespace lamina
