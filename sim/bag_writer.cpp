// Measurements to messages.
#include <lamina/sim/bag_writer.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include <lamina/models/error.hpp>

namespace lamina::sim {
namespace {

constexpr const char* kBody = "base_link";
constexpr const char* kLaser = "laser";
constexpr const char* kCamera = "camera_depth_optical_frame";

// As a dataset folder has it.
double rounded(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return std::strtod(text, nullptr);
}

bag::PlainPose pose_of(const SE3& T, const char* translation, const char* rotation) {
  bag::PlainPose pose{};
  const Eigen::Vector3d& t = T.translation();
  const Eigen::Vector4d& q = T.so3().quaternion().coeffs();
  for (int i = 0; i < 3; ++i) pose[static_cast<std::size_t>(i)] = rounded(translation, t[i]);
  for (int i = 0; i < 4; ++i) pose[static_cast<std::size_t>(i + 3)] = rounded(rotation, q[i]);
  return pose;
}

bag::Message message(bag::Kind kind, const char* topic, const char* frame, Timestamp stamp) {
  bag::Message m;
  m.kind = kind;
  m.topic = topic;
  m.frame = frame;
  m.stamp_ns = stamp.nanoseconds();
  return m;
}

bag::Message mount(const char* frame, const SE3& T_body_sensor, Timestamp stamp) {
  bag::Message m = message(bag::Kind::kTransform, "/tf_static", kBody, stamp);
  m.child_frame = frame;
  m.pose = pose_of(T_body_sensor, "%.9g", "%.12g");
  return m;
}

}  // namespace

DatasetFormat dataset_format(const std::string& name) {
  if (name == "folder") return DatasetFormat::kFolder;
  if (name == "bag") return DatasetFormat::kBag;
  if (name == "db3") return DatasetFormat::kDb3;
  if (name == "mcap") return DatasetFormat::kMcap;
  throw Error("--format: found '" + name + "', expected folder, bag, db3 or mcap");
}

std::unique_ptr<bag::Sink> make_dataset_sink(const std::filesystem::path& folder,
                                             DatasetFormat format) {
  const std::filesystem::path file = folder / "recording.bag";
  if (format == DatasetFormat::kBag) {
    try {
      return bag::make_ros1_sink(file.string());
    } catch (const std::runtime_error& error) {
      throw input_error(file.string(), "", error.what(), "a writable folder");
    }
  }
  return bag::make_ros2_sink((folder / "recording").string(),
                             format == DatasetFormat::kDb3 ? "db3" : "mcap");
}

BagWriter::BagWriter(std::unique_ptr<bag::Sink> sink, const Calibration& calibration)
    : sink_(std::move(sink)), calibration_(calibration) {}

// Mountings, at the time of the first measurement.
void BagWriter::begin(Timestamp first) {
  if (begun_) return;
  begun_ = true;
  if (calibration_.lidar) sink_->write(mount(kLaser, calibration_.lidar->T_body_lidar, first));
  if (calibration_.depth_camera)
    sink_->write(mount(kCamera, calibration_.depth_camera->camera.T_body_camera, first));
}

void BagWriter::write(const DepthFrame& frame) {
  begin(frame.stamp);
  const CameraModel& c = calibration_.depth_camera->camera;
  auto info = message(bag::Kind::kCameraInfo, "/camera/depth/camera_info", kCamera, frame.stamp);
  info.width = frame.width();
  info.height = frame.height();
  info.distortion_model = "plumb_bob";
  info.distortion.assign(5, 0);
  info.intrinsics = {rounded("%.10g", c.fx), rounded("%.10g", c.fy), rounded("%.10g", c.cx),
                     rounded("%.10g", c.cy)};
  sink_->write(info);
  auto image = message(bag::Kind::kDepth, "/camera/depth/image_raw", kCamera, frame.stamp);
  image.width = frame.width();
  image.height = frame.height();
  image.depth = frame.raw;
  const double scale = 1000 / frame.camera.depth_scale;  // 16UC1 is millimetres [REP118]
  for (std::uint16_t& depth : image.depth)
    depth = static_cast<std::uint16_t>(std::min(65535.0, std::round(depth * scale)));
  sink_->write(image);
}

void BagWriter::write(const LaserScan& scan) {
  begin(scan.stamp);
  auto m = message(bag::Kind::kScan, "/scan", kLaser, scan.stamp);
  m.angle_min = static_cast<float>(rounded("%.10g", scan.angle_min));
  m.angle_increment = static_cast<float>(rounded("%.10g", scan.angle_increment));
  m.range_min = static_cast<float>(rounded("%g", scan.range_min));
  m.range_max = static_cast<float>(rounded("%g", scan.range_max));
  m.ranges.reserve(scan.size());
  for (const float range : scan.ranges) {
    const double metres = range > 0 ? rounded("%.4f", static_cast<double>(range)) : 0;
    m.ranges.push_back(static_cast<float>(metres));
  }
  sink_->write(m);
}

void BagWriter::write(const Odometry& odometry) {
  begin(odometry.stamp);
  auto m = message(bag::Kind::kOdometry, "/odom", "odom", odometry.stamp);
  m.child_frame = kBody;
  m.pose = pose_of(odometry.T_odom_body, "%.9f", "%.9f");
  sink_->write(m);
  m.kind = bag::Kind::kTransform;
  m.topic = "/tf";
  sink_->write(m);
}

void BagWriter::write(const Accelerometer& sample) {
  begin(sample.stamp);
  auto m = message(bag::Kind::kImu, "/imu", kBody, sample.stamp);
  for (int i = 0; i < 3; ++i)
    m.acceleration[static_cast<std::size_t>(i)] = rounded("%.6f", sample.acceleration_body[i]);
  sink_->write(m);
}

}  // namespace lamina::sim
