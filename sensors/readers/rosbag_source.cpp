// Reads ROS 1 messages. The only file that sees ROS headers; compiled as C++17.
#include "rosbag_source.hpp"

#include <console_bridge/console.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/query.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>

#include <lamina/models/median.hpp>

namespace lamina::bag {
namespace {
constexpr std::int64_t kLargestImage = 16384;

std::int64_t to_ns(const ros::Time& time) {
  return static_cast<std::int64_t>(time.sec) * 1000000000 + static_cast<std::int64_t>(time.nsec);
}

template <typename Translation, typename Rotation>
PlainPose to_pose(const Translation& t, const Rotation& q) {
  return {t.x, t.y, t.z, q.x, q.y, q.z, q.w};
}

std::uint16_t to_millimetres(float value, float unit) {
  const float metres = value * unit;
  if (!(metres > 0) || !(metres < 65.535f)) return 0;  // false for NaN
  return static_cast<std::uint16_t>(std::lround(metres * 1000.0f));
}

// No camera measures at hundreds of metres: such values are millimetres. 0: hardly any value.
float unit_of(std::vector<float> values) {
  constexpr std::size_t kEnough = 50;
  constexpr float kFar = 100;  // m
  values.erase(std::remove_if(values.begin(), values.end(),
                              [](float v) { return !(v > 0) || !std::isfinite(v); }),
               values.end());
  if (values.size() < kEnough) return 0;
  return median(values) > kFar ? 0.001f : 1.0f;
}

bool is_depth_encoding(const std::string& encoding) {
  return encoding == "16UC1" || encoding == "mono16" || encoding == "32FC1";
}

// False when the image is no depth or its size and its bytes do not agree. `unit`: of a topic's
// floats, m; 0 until an image tells it.
bool convert(const sensor_msgs::Image& in, float& unit, Message& out) {
  if (!is_depth_encoding(in.encoding)) return false;
  const bool floats = in.encoding == "32FC1";
  const std::size_t pixel_bytes = floats ? 4 : 2;
  const std::size_t width = in.width, height = in.height;
  if (width == 0 || height == 0 || width > kLargestImage || height > kLargestImage) return false;
  if (in.step < width * pixel_bytes) return false;
  if (in.data.size() < in.step * (height - 1) + width * pixel_bytes) return false;
  out.kind = Kind::kDepth;
  out.width = static_cast<int>(width);
  out.height = static_cast<int>(height);
  out.metres = floats;
  out.depth.resize(width * height);
  std::vector<float> values(floats ? width * height : 0);
  for (std::size_t v = 0; v < height; ++v) {
    const unsigned char* row = in.data.data() + v * in.step;
    for (std::size_t u = 0; u < width; ++u) {
      unsigned char bytes[4];
      for (std::size_t b = 0; b < pixel_bytes; ++b) {
        bytes[b] = row[u * pixel_bytes + (in.is_bigendian ? pixel_bytes - 1 - b : b)];
      }
      std::uint16_t& pixel = out.depth[v * width + u];
      if (floats) {
        std::memcpy(&values[v * width + u], bytes, sizeof(float));
      } else {
        std::memcpy(&pixel, bytes, sizeof pixel);
      }
    }
  }
  if (floats && unit == 0) unit = unit_of(values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    out.depth[i] = to_millimetres(values[i], unit == 0 ? 1.0f : unit);
  }
  out.floats_in_mm = floats && unit == 0.001f;
  return true;
}

void convert(const sensor_msgs::LaserScan& in, Message& out) {
  out.kind = Kind::kScan;
  out.angle_min = in.angle_min;
  out.angle_increment = in.angle_increment;
  out.range_min = in.range_min;
  out.range_max = in.range_max;
  out.time_increment = in.time_increment;
  out.ranges = in.ranges;
}

void convert(const sensor_msgs::CameraInfo& in, Message& out) {
  out.kind = Kind::kCameraInfo;
  out.width = static_cast<int>(in.width);
  out.height = static_cast<int>(in.height);
  out.intrinsics = {in.K[0], in.K[4], in.K[2], in.K[5]};
  out.distortion.assign(in.D.begin(), in.D.end());
  out.distortion_model = in.distortion_model;
}
}  // namespace

struct Source::Impl {
  rosbag::Bag bag;
  std::unique_ptr<rosbag::View> view;
  rosbag::View::iterator position;
  std::deque<Message> waiting;  // transforms of one message
  struct DepthUnit {
    float metres = 0;  // 0: not known yet
  };
  std::map<std::string, DepthUnit> units;  // of topics of 32FC1

  Status read(const rosbag::MessageInstance& in, Message& out);
  void read_transforms(const rosbag::MessageInstance& in, const tf2_msgs::TFMessage& message);
};

Source::Source(const std::string& file) : impl_(std::make_unique<Impl>()) {
  try {
    console_bridge::noOutputHandler();  // what fails is thrown, and said once
    impl_->bag.open(file, rosbag::bagmode::Read);
    impl_->view = std::make_unique<rosbag::View>(impl_->bag);
    impl_->position = impl_->view->begin();
  } catch (const std::exception& error) {
    throw std::runtime_error(error.what());
  }
}

Source::~Source() = default;

std::vector<Topic> Source::topics() const {
  std::map<std::string, Topic> found;
  rosbag::View all(impl_->bag);
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    Topic& topic = found[connection->topic];
    topic.name = connection->topic;
    topic.type = connection->datatype;
  }
  std::vector<Topic> result;
  for (auto& [name, topic] : found) {
    rosbag::View one(impl_->bag, rosbag::TopicQuery(name));
    topic.count = one.size();
    result.push_back(topic);
  }
  return result;
}

void Source::select(const std::vector<std::string>& topics) {
  impl_->view = std::make_unique<rosbag::View>(impl_->bag, rosbag::TopicQuery(topics));
  impl_->position = impl_->view->begin();
  impl_->waiting.clear();
}

void Source::Impl::read_transforms(const rosbag::MessageInstance& in,
                                   const tf2_msgs::TFMessage& message) {
  for (const auto& transform : message.transforms) {
    Message out;
    out.kind = Kind::kTransform;
    out.topic = in.getTopic();
    out.frame = transform.header.frame_id;
    out.child_frame = transform.child_frame_id;
    out.stamp_ns = to_ns(transform.header.stamp);
    out.pose = to_pose(transform.transform.translation, transform.transform.rotation);
    waiting.push_back(out);
  }
}

Source::Status Source::Impl::read(const rosbag::MessageInstance& in, Message& out) {
  out = Message();
  out.topic = in.getTopic();
  const auto head = [&](const std_msgs::Header& header) {
    out.frame = header.frame_id;
    out.stamp_ns = header.stamp.isZero() ? to_ns(in.getTime()) : to_ns(header.stamp);
  };
  if (const auto scan = in.instantiate<sensor_msgs::LaserScan>()) {
    head(scan->header);
    convert(*scan, out);
  } else if (const auto odometry = in.instantiate<nav_msgs::Odometry>()) {
    head(odometry->header);
    out.kind = Kind::kOdometry;
    out.child_frame = odometry->child_frame_id;
    out.pose = to_pose(odometry->pose.pose.position, odometry->pose.pose.orientation);
  } else if (const auto image = in.instantiate<sensor_msgs::Image>()) {
    head(image->header);
    if (!convert(*image, units[out.topic].metres, out)) return Status::kWrongFormat;
  } else if (const auto info = in.instantiate<sensor_msgs::CameraInfo>()) {
    head(info->header);
    convert(*info, out);
  } else if (const auto imu = in.instantiate<sensor_msgs::Imu>()) {
    head(imu->header);
    out.kind = Kind::kImu;
    const auto& a = imu->linear_acceleration;
    out.acceleration = {a.x, a.y, a.z};
  } else {
    return Status::kWrongFormat;
  }
  return Status::kMessage;
}

Source::Status Source::next(Message& message) {
  while (true) {
    if (!impl_->waiting.empty()) {
      message = std::move(impl_->waiting.front());
      impl_->waiting.pop_front();
      return Status::kMessage;
    }
    if (impl_->position == impl_->view->end()) return Status::kEnd;
    Status status = Status::kDamaged;
    bool transforms = false;
    try {
      const rosbag::MessageInstance& instance = *impl_->position;
      if (const auto tf = instance.instantiate<tf2_msgs::TFMessage>()) {
        impl_->read_transforms(instance, *tf);
        transforms = true;
      } else {
        status = impl_->read(instance, message);
      }
    } catch (const std::exception&) {
      status = Status::kDamaged;
    }
    ++impl_->position;
    if (!transforms) return status;
  }
}

}  // namespace lamina::bag
