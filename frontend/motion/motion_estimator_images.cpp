// Motion by images: all there is, where all else has stopped, or beside wheels that may slip.
#include <lamina/frontend/motion/motion_covariances.hpp>
#include <lamina/frontend/motion/motion_estimator.hpp>
#include <lamina/frontend/motion/out_of_plane_motion.hpp>
#include <lamina/frontend/motion/planar.hpp>

namespace lamina {
namespace {

// As the floor has the camera: the body stands on that.
DepthFrame mounted(const DepthFrame& frame, const Step& step) {
  DepthFrame turned = frame;
  turned.camera.camera.T_body_camera = step.observations.T_body_sensor;
  return turned;
}

}  // namespace

void MotionEstimator::move(const DepthFrame& frame, const FloorResult& floor,
                           std::optional<Increment> moved, Step& step, Diagnostics& diagnostics) {
  ground_seen_ = true;
  slopes_.add(floor);
  const auto timer = diagnostics.time("odometry");
  if (!wheels_.met() && !scan_.stamp) {
    moved = by_images_alone(frame, floor, step);
  } else if (!moved) {
    moved = bridge(frame, step);
  } else if (images_beside_wheels_ && !scan_.stamp) {
    moved = beside_wheels(frame, step, *moved);
  }
  keep_slopes_in_mind(frame.stamp, *moved);
  place(frame.stamp, off_plane(frame, step, *moved), step);
  point_up(step);
  step.slopes = slopes_.of_late(frame.stamp);
  image_.stamp = frame.stamp;
  image_.T_start_body = T_start_body_;
  image_.since.setZero();
}

void MotionEstimator::move(const CloudFrame& cloud, const FloorResult& floor,
                           std::optional<Increment> moved, Step& step) {
  ground_seen_ = true;
  if (!moved) moved = coasted(cloud.stamp, step);
  if (!last_step_ && !wheels_.met() && floor.floor_camera) {
    levelled_by_image_ = true;
    moved->T_from_to = levelled_pose(cloud.T_body_sensor * *floor.floor_camera);
  }
  place(cloud.stamp, *moved, step);
}

// No wheels: the camera is the robot, at the mounting its calibration gives. The map's z is the
// normal of the first floor seen, the floor is z = 0, x along the first heading.
Increment MotionEstimator::by_images_alone(const DepthFrame& frame, const FloorResult& floor,
                                           Step& step) {
  const SE3& T_body_camera = frame.camera.camera.T_body_camera;
  step.observations.T_body_sensor = T_body_camera;
  const ImageMotionResult observed = images_.add(frame, image_.stamp);
  step.motion_known = observed.known;
  step.open_direction = observed.open_direction;
  step.tracking_lost = observed.lost;
  if (last_step_) return observed.increment;
  if (!floor.floor_camera) return {SE3(), still_covariance()};
  levelled_by_image_ = true;
  return {levelled_pose(T_body_camera * *floor.floor_camera), still_covariance()};
}

// Neither wheels nor a scan of late: the first image is one to compare others with.
Increment MotionEstimator::bridge(const DepthFrame& frame, Step& step) {
  if (scanned_of_late(frame.stamp)) return coasted(frame.stamp, step);
  const ImageMotionResult observed = images_.add(mounted(frame, step), image_.stamp);
  if (observed.first || observed.lost) {
    const Increment on = coasted(frame.stamp, step);
    step.tracking_lost = step.tracking_lost || observed.lost;
    return on;
  }
  step.motion_known = step.by_image = true;
  step.open_direction = observed.open_direction;
  return {T_start_body_.inverse() * image_.T_start_body * observed.increment.T_from_to,
          observed.increment.covariance};
}

// Wheels slip, and an image shows it.
Increment MotionEstimator::beside_wheels(const DepthFrame& frame, Step& step,
                                         const Increment& wheels) {
  const bool tilts = follow_slopes_ && slopes_.of_late(frame.stamp);
  const Increment expected = tilts ? tilting(wheels) : wheels;
  const ImageMotionResult observed = images_.add(
      mounted(frame, step), image_.stamp, MotionGuess{expected.T_from_to, expected.covariance});
  step.left_to_wheels = observed.left_to_wheels;
  if (observed.first || !observed.known || observed.doubtful) return wheels;
  step.by_image = true;
  return observed.increment;
}

// A body that stands before a ramp is still before it when it goes on.
void MotionEstimator::keep_slopes_in_mind(Timestamp stamp, const Increment& moved) {
  constexpr double kStanding = 0.02;  // m/s
  if (!image_.stamp) return;
  const double dt = stamp - *image_.stamp;
  const SE3 since_image = image_.T_start_body.inverse() * T_start_body_ * moved.T_from_to;
  if (since_image.translation().norm() < kStanding * dt) slopes_.stood(stamp, dt);
}

// What `moved` lacks where the ground changes its slope: beside a scanner images tell it, as
// matches of scans would hold the body level.
Increment MotionEstimator::off_plane(const DepthFrame& frame, const Step& step,
                                     const Increment& moved) {
  if (!follow_slopes_ || !scan_.stamp || !slopes_.of_late(frame.stamp) || step.by_image)
    return moved;
  if (!step.motion_known && !scanned_of_late(frame.stamp)) return moved;
  const Matrix6d J = moved.T_from_to.inverse().adjoint();
  Increment level{image_.T_start_body.inverse() * T_start_body_ * moved.T_from_to,
                  J * image_.since * J.transpose() + moved.covariance};
  level = open_to_slopes(level, level.T_from_to.translation().norm());
  const ImageMotionResult observed = images_.add(mounted(frame, step), image_.stamp,
                                                 MotionGuess{level.T_from_to, level.covariance});
  if (observed.first || !observed.known || observed.doubtful) return tilting(moved);
  const Lift lift = Lift::between(level, observed.increment);
  const SE3 off = SE3::exp(lift.off);
  scan_.lifted = scan_.lifted ? *scan_.lifted * off : off;
  return lift.applied(moved);
}

}  // namespace lamina
