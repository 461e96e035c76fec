// Puts extraction and tracking together, and keeps account of motion and of useless scans.
#include <lamina/frontend/segments/segment_frontend.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

NoiseFloor noise_floor(const ScanSegment& segment, const LidarNoise& noise) {
  return {noise.range_floor, noise.range_floor / std::max(segment.length(), 0.1)};
}

SegmentFrontend::SegmentFrontend(const SegmentOptions& segments, const TrackingOptions& tracking)
    : extractor_(segments), tracker_(tracking) {}

bool SegmentFrontend::usable(const LaserScan& scan) {
  const char* reason = nullptr;
  if (scan.ranges.empty()) {
    reason = "scan without beams";
  } else if (!std::isfinite(scan.angle_min) || !std::isfinite(scan.angle_increment) ||
             (scan.angle_increment == 0 && scan.size() > 1)) {
    reason = "scan of bad geometry";
  } else if (last_stamp_ && scan.stamp == *last_stamp_) {
    reason = "scan of repeated stamp";
  } else if (last_stamp_ && scan.stamp < *last_stamp_) {
    reason = "scan goes back in time";
  } else if (std::none_of(scan.ranges.begin(), scan.ranges.end(),
                          [](float r) { return std::isfinite(r) && r > 0; })) {
    reason = "scan without returns";
  }
  if (reason) ++skipped_[reason];
  return reason == nullptr;
}

// In the right tangent of the motion: a random walk over what was travelled and turned.
Matrix6d SegmentFrontend::motion_covariance(const std::optional<SE3>& T_prev_curr_body) const {
  const TrackingOptions& options = tracker_.options();
  Vector6d sigma;
  if (!T_prev_curr_body) {
    sigma << Eigen::Vector3d::Constant(options.no_odometry_sigma_m),
        Eigen::Vector3d::Constant(options.no_odometry_sigma_rad);
    return sigma.cwiseAbs2().asDiagonal();
  }
  const OdometryModel& model = options.odometry;
  const double distance = T_prev_curr_body->translation().norm();
  const double turn = T_prev_curr_body->so3().log().norm();
  const double still_m = options.odometry_sigma_m * options.odometry_sigma_m;
  const double still_rad = options.odometry_sigma_rad * options.odometry_sigma_rad;
  const double moved = model.sigma_translation * model.sigma_translation * distance;
  const double turned = model.sigma_rotation * model.sigma_rotation * distance +
                        model.sigma_rotation_turn * model.sigma_rotation_turn * turn;
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(still_m + moved),
      Eigen::Vector3d::Constant(still_rad + turned);
  if (model.planar) {  // wheels hold height, roll and pitch
    variance.segment<3>(2) << still_m, still_rad, still_rad;
  }
  return variance.asDiagonal();
}

Observations SegmentFrontend::process(const LaserScan& scan,
                                      const std::optional<SE3>& T_prev_curr_body) {
  Observations out;
  out.stamp = scan.stamp;
  out.sensor = SensorKind::kLidar;
  out.T_body_sensor = scan.lidar.T_body_lidar;
  last_ = Segments();
  if (last_stamp_) {
    // The pending motion's uncertainty is carried into the new body frame, then grows.
    const SE3 motion = T_prev_curr_body.value_or(SE3());
    const Matrix6d carry = motion.inverse().adjoint();
    pending_covariance_ =
        carry * pending_covariance_ * carry.transpose() + motion_covariance(T_prev_curr_body);
    pending_motion_ = pending_motion_ * motion;
  }
  if (!usable(scan)) return out;
  last_ = extractor_.extract(scan);
  track(scan, out);
  for (const int beam : last_.loose_beams) {
    const Eigen::Vector2d p = scan.point(static_cast<std::size_t>(beam));
    out.obstacle_points_body.push_back(out.T_body_sensor * Eigen::Vector3d(p.x(), p.y(), 0));
  }
  last_stamp_ = scan.stamp;
  return out;
}

void SegmentFrontend::track(const LaserScan& scan, Observations& out) {
  std::vector<NoiseFloor> floors;
  for (const ScanSegment& segment : last_.segments) {
    floors.push_back(noise_floor(segment, scan.lidar.noise));
  }
  T_body_lidar_ = scan.lidar.T_body_lidar;
  const SE3 T_lidar_body = T_body_lidar_.inverse();
  const Matrix6d lever = T_lidar_body.adjoint();
  const std::vector<std::int64_t> ids = tracker_.update(
      last_.segments, floors, scan.stamp, T_lidar_body * pending_motion_ * T_body_lidar_,
      lever * pending_covariance_ * lever.transpose());
  pending_motion_ = SE3();
  pending_covariance_.setZero();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    out.segments.push_back({last_.segments[i], floors[i], ids[i]});
  }
}

bool SegmentFrontend::set_plane(std::int64_t track, const Plane& plane_body,
                                const Eigen::Matrix3d& covariance) {
  // About the body's origin to about the scanner's: rho shifts by the lever arm, with its tilts.
  const SE3 T_lidar_body = T_body_lidar_.inverse();
  const Plane plane_lidar = T_lidar_body * plane_body;
  const Matrix32d from = plane_body.tangent_basis(), to = plane_lidar.tangent_basis();
  const Eigen::Matrix3d R = T_lidar_body.so3().matrix();
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
  J.topLeftCorner<2, 2>() = to.transpose() * R * from;
  J.bottomLeftCorner<1, 2>() = T_lidar_body.translation().transpose() * R * from;
  J(2, 2) = 1;
  return tracker_.set_plane(track, plane_lidar, J * covariance * J.transpose());
}

}  // namespace lamina
