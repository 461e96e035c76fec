// A bag's messages become measurements.
#include <lamina/sensors/readers/bag_frames.hpp>
#include <lamina/sensors/readers/bag_recording.hpp>

namespace lamina {
using bag::is_empty, bag::kRawPerMetre;

// Every recorded one, as a dataset folder gives them: up to `until`, or all.
void BagRecording::push_odometry(std::optional<Timestamp> until) {
  const Trajectory& samples = track_.trajectory();
  for (; next_odometry_ < samples.size(); ++next_odometry_) {
    const StampedPose& sample = samples[next_odometry_];
    if (until && sample.stamp > *until) return;
    if (odometry_given_.insert(sample.stamp).second)
      buffer_.push(Odometry{sample.stamp, sample.pose});
  }
}

void BagRecording::push_frame(Measurement frame) {
  const Timestamp stamp = stamp_of(frame);
  push_odometry(stamp);
  if (odometry_given_.insert(stamp).second) {
    if (const auto odometry = track_.at(stamp)) buffer_.push(*odometry);
  }
  if (!buffer_.push(std::move(frame))) skips_.add(kSkipTimeBack);
}

void BagRecording::convert(bag::Message& message) {
  const Timestamp stamp = Timestamp::from_nanoseconds(message.stamp_ns);
  slice_cloud(message);
  if (message.kind == bag::Kind::kScan) convert_scan(message);
  if (message.kind == bag::Kind::kDepth && !light_) convert_depth(message, stamp);
  if (message.kind == bag::Kind::kCloud && !light_) convert_cloud(message, stamp);
  if (message.kind == bag::Kind::kImu) convert_imu(message, stamp);
  if (live_) add_live_odometry(message);
}

void BagRecording::convert_imu(const bag::Message& message, Timestamp stamp) {
  const auto& a = message.acceleration;
  Accelerometer sample{stamp, {a[0], a[1], a[2]}};
  if (const auto pose = T_body(message.frame)) {
    sample.acceleration_body = pose->so3() * sample.acceleration_body;
  }
  if (!buffer_.push(sample)) skips_.add(kSkipTimeBack);
}

void BagRecording::convert_cloud(const bag::Message& message, Timestamp stamp) {
  CloudFrame frame;
  frame.stamp = stamp;
  frame.width = message.width;
  frame.height = message.height;
  frame.points_sensor.reserve(message.points.size());
  for (const auto& [x, y, z] : message.points) frame.points_sensor.emplace_back(x, y, z);
  frame.T_body_sensor = T_body(message.frame).value_or(SE3());
  push_frame(std::move(frame));
}

// Of the scan topic, a cloud becomes the scan of a band of heights.
void BagRecording::slice_cloud(bag::Message& message) {
  if (message.kind != bag::Kind::kCloud || !slice_ || message.topic != topic_of("scan")) return;
  const std::string frame = frame_name(message.frame);
  scanner(frame);
  LaserScan scan = slice_of(message.points, cloud_places_.at(frame), *slice_);
  message.kind = bag::Kind::kScan;
  message.angle_min = static_cast<float>(scan.angle_min);
  message.angle_increment = static_cast<float>(scan.angle_increment);
  message.range_min = static_cast<float>(scan.range_min);
  message.range_max = static_cast<float>(scan.range_max);
  message.ranges = std::move(scan.ranges);
}

void BagRecording::convert_scan(bag::Message& message) {
  if (is_empty(message)) {
    skips_.add("empty scan");
    return;
  }
  Scans& scans = scans_[frame_name(message.frame)];
  auto used =
      live_ ? Timestamp::from_nanoseconds(message.stamp_ns) : scans.stream.stamp(scans.next++);
  if (!used) return;
  if (last_scan_ && *used == *last_scan_) used = *used + 1e-6;
  last_scan_ = used;
  const auto step = static_cast<double>(message.angle_increment);
  if (beyond_one_turn(step, message.ranges.size())) {
    skips_.add(kSkipBeyondTurn, 1,
               message.topic + ": " + beyond_one_turn_text(step, message.ranges.size()));
    return;
  }
  LaserScan scan;
  scan.stamp = *used;
  scan.angle_min = static_cast<double>(message.angle_min);
  scan.angle_increment = step;
  scan.range_min = std::isfinite(message.range_min) ? static_cast<double>(message.range_min) : 0;
  scan.range_max = std::isfinite(message.range_max) ? static_cast<double>(message.range_max) : 0;
  scan.ranges = std::move(message.ranges);
  scans.stream.correct(scan);
  // [ROS]: beam 0 is at the stamp.
  const auto increment = static_cast<double>(message.time_increment);
  const double sweep = increment * static_cast<double>(scan.size() - 1);
  if (increment > 0 && scans.stream.sweep_can_be(sweep)) scan.time_increment = increment;
  scan.lidar = scanner(frame_name(message.frame));
  push_frame(std::move(scan));
}

void BagRecording::convert_depth(bag::Message& message, Timestamp stamp) {
  if (!calibration_.depth_camera) place_camera(message);
  DepthCamera& camera = *calibration_.depth_camera;
  if (message.width != camera.camera.width || message.height != camera.camera.height) {
    skips_.add(kSkipWrongSize);
    return;
  }
  camera.depth_scale = kRawPerMetre;
  if (!rectifier_) rectifier_.emplace(camera.camera);
  saturated_.drop(message.depth);
  DepthFrame frame{stamp, camera, rectifier_->depth(message.depth)};
  frame.camera.camera.distortion.reset();
  push_frame(std::move(frame));
}

}  // namespace lamina
