// Routing and dead reckoning.
#include <lamina/apps/front_end.hpp>

namespace lamina::apps {
namespace {

// Where nothing measured the motion: anything a robot does between two frames is likely.
Matrix6d still_covariance() {
  constexpr double kMetres = 0.3, kRadians = 0.3;
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(kMetres * kMetres),
      Eigen::Vector3d::Constant(kRadians * kRadians);
  return variances.asDiagonal();
}

// Tracks are predicted with the wheels' own uncertainty.
TrackingOptions with_odometry(TrackingOptions tracking, const OdometryModel& odometry) {
  tracking.odometry = odometry;
  return tracking;
}

}  // namespace

FrontEnd::FrontEnd(const Settings& settings, const Calibration& calibration)
    : wheels_(calibration.odometry),
      floor_(settings.floor),
      segments_(settings.segments, with_odometry(settings.tracking, calibration.odometry)),
      scan_odometry_(settings.scan_odometry) {}

std::optional<Step> FrontEnd::process(const Measurement& measurement, io::Metrics& metrics) {
  if (const auto* odometry = std::get_if<Odometry>(&measurement)) {
    wheels_.add(*odometry);
    return std::nullopt;
  }
  if (const auto* scan = std::get_if<LaserScan>(&measurement)) return process_scan(*scan, metrics);
  if (const auto* depth = std::get_if<DepthFrame>(&measurement)) {
    return process_depth(*depth, SensorKind::kDepth, metrics);
  }
  if (const auto* pair = std::get_if<StereoFrame>(&measurement)) {
    const DepthFrame frame = [&] {
      const auto timer = metrics.time("stereo");
      return depth_from_stereo(*pair);
    }();
    return process_depth(frame, SensorKind::kStereo, metrics);
  }
  return std::nullopt;
}

bool FrontEnd::out_of_order(Timestamp stamp) {
  if (!last_step_ || stamp > *last_step_) return false;
  ++skipped_["stamp repeats or goes back"];
  return true;
}

Increment FrontEnd::advance(const SE3& T_start_body, const Matrix6d& covariance, Timestamp stamp) {
  const Increment increment{T_start_body_.inverse() * T_start_body, covariance};
  T_start_body_ = T_start_body;
  last_step_ = stamp;
  return increment;
}

std::optional<Step> FrontEnd::process_scan(const LaserScan& scan, io::Metrics& metrics) {
  if (out_of_order(scan.stamp)) return std::nullopt;
  std::optional<MotionGuess> guess;
  if (last_scan_) {
    if (const auto moved = wheels_.between(*last_scan_, scan.stamp)) {
      guess = MotionGuess{moved->T_from_to, moved->covariance};
    }
  }
  Step step;
  ScanMotion motion;
  {
    const auto timer = metrics.time("odometry");
    motion = scan_odometry_.process(scan, guess);
  }
  {
    const auto timer = metrics.time("segments");
    step.observations = segments_.process(
        scan, last_scan_ ? std::optional<SE3>(motion.T_prev_curr_body) : std::nullopt);
  }
  const SE3 T_start_body = T_start_scan_body_ * motion.T_prev_curr_body;
  step.motion = advance(T_start_body, motion.covariance, scan.stamp);
  step.motion_known = guess.has_value() || motion.status == ScanMotion::Status::kTracked;
  T_start_scan_body_ = T_start_body;
  last_scan_ = scan.stamp;
  wheels_.forget_before(scan.stamp);
  step.T_start_body = T_start_body;
  step.scan = scan;
  step.scan_motion = motion;
  return step;
}

std::optional<Step> FrontEnd::process_depth(const DepthFrame& frame, SensorKind kind,
                                            io::Metrics& metrics) {
  if (out_of_order(frame.stamp)) return std::nullopt;
  Step step;
  std::optional<Increment> moved;
  if (last_step_) moved = wheels_.between(*last_step_, frame.stamp);
  {
    const auto timer = metrics.time("floor");
    FloorResult floor = floor_.process(frame);
    floor.sensor = kind;
    step.observations = floor.to_observations();
  }
  step.motion_known = moved.has_value() || !last_step_;
  if (!moved) moved = Increment{SE3(), still_covariance()};
  step.motion = advance(T_start_body_ * moved->T_from_to, moved->covariance, frame.stamp);
  step.T_start_body = T_start_body_;
  return step;
}

std::map<std::string, std::int64_t> FrontEnd::skipped() const {
  std::map<std::string, std::int64_t> all = skipped_;
  for (const auto& [why, count] : segments_.skipped()) all["scan: " + why] += count;
  return all;
}

}  // namespace lamina::apps
