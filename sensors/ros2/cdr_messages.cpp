// One function a type, fields in the order of its definition [ROS2Interfaces].
#include <lamina/sensors/ros2/cdr_messages.hpp>

#include <map>

#include <lamina/sensors/readers/bag_cloud.hpp>
#include <lamina/sensors/ros2/cdr_reader.hpp>

namespace lamina::ros2 {
namespace {

using bag::Kind;
using bag::Message;

struct Reading {
  CdrReader& in;
  Message& out;
  bag::DepthReader& depth;
  std::deque<Message>& transforms;
};

void read_header(CdrReader& in, Message& out) {
  const std::int64_t seconds = in.i32(), nanoseconds = in.u32();
  if (seconds != 0 || nanoseconds != 0) out.stamp_ns = seconds * bag::kSecond + nanoseconds;
  out.frame = in.string();
}

bag::PlainPose read_pose(CdrReader& in) {
  bag::PlainPose pose{};
  for (double& value : pose) value = in.f64();
  return pose;
}

const unsigned char* start_of(std::string_view bytes) {
  const void* data = bytes.data();
  return static_cast<const unsigned char*>(data);
}

void read_geometry(CdrReader& in, Message& out) {
  out.kind = Kind::kScan;
  out.angle_min = in.f32();
  in.f32();  // angle_max
  out.angle_increment = in.f32();
  out.time_increment = in.f32();
  in.f32();  // scan_time
  out.range_min = in.f32();
  out.range_max = in.f32();
}

bool read_scan(Reading& r) {
  read_geometry(r.in, r.out);
  r.out.ranges = r.in.floats();
  return true;
}

bool read_echoes(Reading& r) {
  read_geometry(r.in, r.out);
  const std::size_t beams = r.in.length(sizeof(std::uint32_t));
  for (std::size_t i = 0; i < beams; ++i) {
    const std::vector<float> echoes = r.in.floats();
    r.out.ranges.push_back(echoes.empty() ? 0 : echoes.front());
  }
  return true;
}

bool read_image(Reading& r) {
  bag::RawImage image;
  image.height = r.in.u32();
  image.width = r.in.u32();
  image.encoding = r.in.string();
  image.bigendian = r.in.u8() != 0;
  image.step = r.in.u32();
  const std::string_view data = r.in.bytes();
  image.data = start_of(data);
  image.size = data.size();
  return r.depth.read(image, r.out);
}

bool read_packed_image(Reading& r) {
  bag::PackedImage image;
  image.format = r.in.string();
  const std::string_view data = r.in.bytes();
  image.data = start_of(data);
  image.size = data.size();
  return r.depth.read(image, r.out);
}

bool read_camera_info(Reading& r) {
  r.out.kind = Kind::kCameraInfo;
  const std::uint32_t height = r.in.u32(), width = r.in.u32();
  r.out.height = static_cast<int>(height);
  r.out.width = static_cast<int>(width);
  r.out.distortion_model = r.in.string();
  r.out.distortion = r.in.doubles();
  double k[9];
  for (double& value : k) value = r.in.f64();
  r.out.intrinsics = {k[0], k[4], k[2], k[5]};
  return true;
}

bool read_points(Reading& r) {
  bag::RawCloud cloud;
  cloud.height = r.in.u32();
  cloud.width = r.in.u32();
  const std::size_t fields = r.in.length(13);  // bytes: length of the name, offset, type, count
  for (std::size_t i = 0; i < fields; ++i) {
    bag::RawCloud::Field field;
    field.name = r.in.string();
    field.offset = r.in.u32();
    field.datatype = r.in.u8();
    field.count = r.in.u32();
    cloud.fields.push_back(field);
  }
  cloud.bigendian = r.in.u8() != 0;
  cloud.point_step = r.in.u32();
  cloud.row_step = r.in.u32();
  const std::string_view data = r.in.bytes();
  cloud.data = start_of(data);
  cloud.size = data.size();
  return bag::read_cloud(cloud, r.out);
}

bool read_odometry(Reading& r) {
  r.out.kind = Kind::kOdometry;
  r.out.child_frame = r.in.string();
  r.out.pose = read_pose(r.in);
  return true;
}

bool read_imu(Reading& r) {
  // Orientation, rates and their covariances come before.
  for (int i = 0; i < 4 + 9 + 3 + 9; ++i) r.in.f64();
  for (double& value : r.out.acceleration) value = r.in.f64();
  r.out.kind = Kind::kImu;
  return true;
}

void read_transforms(Reading& r) {
  const std::size_t count = r.in.length(72);  // bytes: stamp, two names' lengths, seven numbers
  std::deque<Message> found;
  for (std::size_t i = 0; i < count; ++i) {
    Message& transform = found.emplace_back();
    transform.kind = Kind::kTransform;
    transform.topic = r.out.topic;
    read_header(r.in, transform);
    transform.child_frame = r.in.string();
    transform.pose = read_pose(r.in);
  }
  r.transforms.insert(r.transforms.end(), found.begin(), found.end());
}

bool read_nothing_more(Reading&) { return true; }

using Function = bool (*)(Reading&);

// Of messages that begin with a header.
Function function_of(const std::string& type) {
  static const std::map<std::string, Function> functions = {
      {"sensor_msgs/LaserScan", read_scan},
      {"sensor_msgs/MultiEchoLaserScan", read_echoes},
      {"sensor_msgs/Image", read_image},
      {"sensor_msgs/CompressedImage", read_packed_image},
      {"sensor_msgs/CameraInfo", read_camera_info},
      {"sensor_msgs/PointCloud2", read_points},
      {"sensor_msgs/Imu", read_imu},
      {"nav_msgs/Odometry", read_odometry},
      {"sensor_msgs/NavSatFix", read_nothing_more},
      {"geometry_msgs/PoseStamped", read_nothing_more},
      {"geometry_msgs/PoseWithCovarianceStamped", read_nothing_more},
      {"apriltag_msgs/AprilTagDetectionArray", read_nothing_more},
  };
  const auto found = functions.find(type);
  return found == functions.end() ? nullptr : found->second;
}

}  // namespace

std::string type_of_ros1(const std::string& type) {
  const std::string between = "/msg/";
  const std::size_t at = type.find(between);
  return at == std::string::npos ? type
                                 : type.substr(0, at) + "/" + type.substr(at + between.size());
}

bag::Source::Status decode(const std::string& type, std::string_view cdr, bag::DepthReader& depth,
                           Message& out, std::deque<Message>& transforms) {
  using Status = bag::Source::Status;
  try {
    const bool tf = type == "tf2_msgs/TFMessage";
    const Function function = function_of(type);
    if (!function && !tf) return Status::kMessage;
    CdrReader in(cdr);
    Reading reading{in, out, depth, transforms};
    if (tf) {
      read_transforms(reading);
      return Status::kMessage;
    }
    read_header(in, out);
    return function(reading) ? Status::kMessage : Status::kWrongFormat;
  } catch (const DamagedCdr&) {
    return Status::kDamaged;
  }
}

}  // namespace lamina::ros2
