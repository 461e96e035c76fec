// Slopes on the way: wheels and scans take the ground for one plane, what a camera sees says more.
#include <algorithm>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/motion/out_of_plane_motion.hpp>

namespace lamina {
namespace {

constexpr double kSlopeTime = 5;  // s of driving that a change of slope is kept in mind

}  // namespace

// Where a camera sees the ground change its slope.
void FrontEnd::look_for_slopes(const FloorResult& floor) {
  constexpr double kLeast = 0.026, kMost = 0.35, kShare = 0.02;  // rad; of the image's pixels
  const double all = static_cast<double>(floor.pixel_labels.size());
  const SE3 off = floor.T_body_camera * floor.mounting.T_body_camera.inverse();
  const bool tilted =
      floor.status == FloorStatus::kFound && off.so3().log().head<2>().norm() > kLeast;
  bool both = false;
  for (const ExtractedPlane& p : floor.planes) {
    const bool ground = p.kind == PlaneKind::kSubDominant && p.slope > kLeast && p.slope < kMost;
    both = both || (ground && static_cast<double>(p.pixels) > kShare * all);
  }
  if (both) last_two_slopes_ = floor.stamp;
  if (!both && !tilted) return;
  ++slopes_seen_;
  last_slope_ = floor.stamp;
}

// A body that stands before a ramp is still before it when it goes on.
void FrontEnd::keep_slopes_in_mind(Timestamp stamp, const Increment& moved) {
  constexpr double kStanding = 0.02;  // m/s
  if (!last_image_) return;
  const double dt = stamp - *last_image_;
  const SE3 since_image = T_start_image_.inverse() * T_start_body_ * moved.T_from_to;
  if (!(since_image.translation().norm() < kStanding * dt)) return;
  for (std::optional<Timestamp>* seen : {&last_slope_, &last_two_slopes_})
    if (*seen) *seen = std::min(stamp, **seen + dt);
}

// A floor that is off where the ground slopes is no knocked camera, however long it is looked at.
// Nor is one where the body is known to stand tilted: until its wheels are off that.
bool FrontEnd::may_be_knocked(Timestamp stamp) {
  const bool may_be = knocks_.may_be(floor_.floor_off(), T_start_body_);
  if (wheels_met_ && !may_be) return false;  // else there is no telling how far it came
  constexpr double kOff = 1;                 // m
  if (T_level_start_ &&
      (!first_step_ || (first_step_->inverse() * T_start_body_).translation().norm() < kOff))
    return false;
  return !last_two_slopes_ || !(stamp - *last_two_slopes_ < kSlopeTime);
}

bool FrontEnd::slopes_of_late(Timestamp stamp) const {
  return last_slope_ && stamp - *last_slope_ < kSlopeTime;
}

// Without a scanner the body may tilt there, and planes that the camera sees say how far.
Increment FrontEnd::tilting(Increment increment) {
  constexpr double kTilt = 0.1;  // rad per square root of a metre: a ramp's whole slope in a length
  const double tilt = kTilt * kTilt * increment.T_from_to.translation().norm();
  increment.covariance(3, 3) += tilt;
  increment.covariance(4, 4) += tilt;
  return increment;
}

// Beside a scanner images tell how far: what matches of scans say would hold the body level.
Increment FrontEnd::off_plane(const DepthFrame& frame, const Step& step, const Increment& moved,
                              Diagnostics& metrics) {
  if (!follow_slopes_ || !last_scan_ || !slopes_of_late(frame.stamp) || step.by_image) return moved;
  if (!step.motion_known && !scanned_of_late(frame.stamp)) return moved;
  const auto timer = metrics.time("odometry");
  const Matrix6d J = moved.T_from_to.inverse().adjoint();
  Increment level{T_start_image_.inverse() * T_start_body_ * moved.T_from_to,
                  J * since_image_ * J.transpose() + moved.covariance};
  level = open_to_slopes(level, level.T_from_to.translation().norm());
  DepthFrame mounted = frame;
  mounted.camera.camera.T_body_camera = step.observations.T_body_sensor;
  const ImageMotionResult observed =
      images_.add(mounted, last_image_, MotionGuess{level.T_from_to, level.covariance});
  if (observed.first || !observed.known || observed.doubtful) return tilting(moved);
  const Lift lift = Lift::between(level, observed.increment);
  const SE3 off = SE3::exp(lift.off);
  lifted_since_scan_ = lifted_since_scan_ ? *lifted_since_scan_ * off : off;
  return lift.applied(moved);
}

// Where up is: as the chain of motions has it, once it has left the plane.
void FrontEnd::point_up(Step& step) {
  ever_lifted_ = ever_lifted_ || lifted_since_scan_.has_value();
  if (!ever_lifted_) return;
  step.observations.up_body = T_start_body_.so3().inverse() * up_map();
}

}  // namespace lamina
