// Reads ROS 1 messages. The only file that sees ROS headers; compiled as C++17.
#include "rosbag_source.hpp"

#include <console_bridge/console.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/query.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/MultiEchoLaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <deque>
#include <map>
#include <stdexcept>

#include <lamina/sensors/readers/bag_cloud.hpp>
#include <lamina/sensors/readers/bag_depth.hpp>

namespace lamina::bag {
namespace {
std::int64_t to_ns(const ros::Time& time) {
  return static_cast<std::int64_t>(time.sec) * 1000000000 + static_cast<std::int64_t>(time.nsec);
}

template <typename Translation, typename Rotation>
PlainPose to_pose(const Translation& t, const Rotation& q) {
  return {t.x, t.y, t.z, q.x, q.y, q.z, q.w};
}

RawImage raw(const sensor_msgs::Image& in) {
  return {in.width,       in.height,     in.step, in.encoding, in.is_bigendian != 0,
          in.data.data(), in.data.size()};
}

RawCloud raw(const sensor_msgs::PointCloud2& in) {
  RawCloud out;
  out.width = in.width;
  out.height = in.height;
  out.point_step = in.point_step;
  out.row_step = in.row_step;
  out.bigendian = in.is_bigendian != 0;
  for (const auto& field : in.fields)
    out.fields.push_back({field.name, field.offset, field.count, field.datatype});
  out.data = in.data.data();
  out.size = in.data.size();
  return out;
}

// Scan is sensor_msgs::LaserScan or MultiEchoLaserScan.
template <typename Scan>
void convert_geometry(const Scan& in, Message& out) {
  out.kind = Kind::kScan;
  out.angle_min = in.angle_min;
  out.angle_increment = in.angle_increment;
  out.range_min = in.range_min;
  out.range_max = in.range_max;
  out.time_increment = in.time_increment;
}

void convert(const sensor_msgs::CameraInfo& in, Message& out) {
  out.kind = Kind::kCameraInfo;
  out.width = static_cast<int>(in.width);
  out.height = static_cast<int>(in.height);
  out.intrinsics = {in.K[0], in.K[4], in.K[2], in.K[5]};
  out.distortion.assign(in.D.begin(), in.D.end());
  out.distortion_model = in.distortion_model;
}

class Ros1Source final : public Source {
 public:
  explicit Ros1Source(const std::string& file) {
    console_bridge::noOutputHandler();  // what fails is thrown, and said once
    bag_.open(file, rosbag::bagmode::Read);
    view_ = std::make_unique<rosbag::View>(bag_);
    position_ = view_->begin();
  }
  std::vector<Topic> topics() const override;
  void select(const std::vector<std::string>& topics) override {
    view_ = std::make_unique<rosbag::View>(bag_, rosbag::TopicQuery(topics));
    position_ = view_->begin();
    waiting_.clear();
  }
  Status next(Message& message) override;

 private:
  Status read(const rosbag::MessageInstance& in, Message& out);
  void read_transforms(const rosbag::MessageInstance& in, const tf2_msgs::TFMessage& message);

  rosbag::Bag bag_;
  std::unique_ptr<rosbag::View> view_;
  rosbag::View::iterator position_;
  std::deque<Message> waiting_;  // transforms of one message
  DepthReader depth_;
};

std::vector<Topic> Ros1Source::topics() const {
  std::map<std::string, Topic> found;
  rosbag::View all(bag_);
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    Topic& topic = found[connection->topic];
    topic.name = connection->topic;
    topic.type = connection->datatype;
  }
  std::vector<Topic> result;
  for (auto& [name, topic] : found) {
    rosbag::View one(bag_, rosbag::TopicQuery(name));
    topic.count = one.size();
    result.push_back(topic);
  }
  return result;
}

void Ros1Source::read_transforms(const rosbag::MessageInstance& in,
                                 const tf2_msgs::TFMessage& message) {
  for (const auto& transform : message.transforms) {
    Message out;
    out.kind = Kind::kTransform;
    out.topic = in.getTopic();
    out.frame = transform.header.frame_id;
    out.child_frame = transform.child_frame_id;
    out.stamp_ns = to_ns(transform.header.stamp);
    out.pose = to_pose(transform.transform.translation, transform.transform.rotation);
    waiting_.push_back(out);
  }
}

Source::Status Ros1Source::read(const rosbag::MessageInstance& in, Message& out) {
  const auto head = [&](const std_msgs::Header& header) {
    out.frame = header.frame_id;
    out.stamp_ns = header.stamp.isZero() ? to_ns(in.getTime()) : to_ns(header.stamp);
  };
  const auto depth = [&](bool good) { return good ? Status::kMessage : Status::kWrongFormat; };
  if (const auto scan = in.instantiate<sensor_msgs::LaserScan>()) {
    head(scan->header);
    convert_geometry(*scan, out);
    out.ranges = scan->ranges;
  } else if (const auto echoes = in.instantiate<sensor_msgs::MultiEchoLaserScan>()) {
    head(echoes->header);
    convert_geometry(*echoes, out);
    for (const auto& beam : echoes->ranges)
      out.ranges.push_back(beam.echoes.empty() ? 0 : beam.echoes.front());
  } else if (const auto odometry = in.instantiate<nav_msgs::Odometry>()) {
    head(odometry->header);
    out.kind = Kind::kOdometry;
    out.child_frame = odometry->child_frame_id;
    out.pose = to_pose(odometry->pose.pose.position, odometry->pose.pose.orientation);
  } else if (const auto image = in.instantiate<sensor_msgs::Image>()) {
    head(image->header);
    return depth(depth_.read(raw(*image), out));
  } else if (const auto packed = in.instantiate<sensor_msgs::CompressedImage>()) {
    head(packed->header);
    return depth(depth_.read({packed->format, packed->data.data(), packed->data.size()}, out));
  } else if (const auto cloud = in.instantiate<sensor_msgs::PointCloud2>()) {
    head(cloud->header);
    return depth(read_cloud(raw(*cloud), out));
  } else if (const auto info = in.instantiate<sensor_msgs::CameraInfo>()) {
    head(info->header);
    convert(*info, out);
  } else if (const auto imu = in.instantiate<sensor_msgs::Imu>()) {
    head(imu->header);
    out.kind = Kind::kImu;
    const auto& a = imu->linear_acceleration;
    out.acceleration = {a.x, a.y, a.z};
  }
  return Status::kMessage;
}

Source::Status Ros1Source::next(Message& message) {
  while (true) {
    if (!waiting_.empty()) {
      message = std::move(waiting_.front());
      waiting_.pop_front();
      return Status::kMessage;
    }
    if (position_ == view_->end()) return Status::kEnd;
    Status status = Status::kDamaged;
    bool transforms = false;
    message = Message();
    try {
      const rosbag::MessageInstance& instance = *position_;
      message.topic = instance.getTopic();
      message.stamp_ns = to_ns(instance.getTime());
      if (const auto tf = instance.instantiate<tf2_msgs::TFMessage>()) {
        read_transforms(instance, *tf);
        transforms = true;
      } else {
        status = read(instance, message);
      }
    } catch (const std::exception&) {
      status = Status::kDamaged;
    }
    ++position_;
    if (!transforms) return status;
  }
}

}  // namespace

std::unique_ptr<Source> open_ros1(const std::string& file) {
  try {
    return std::make_unique<Ros1Source>(file);
  } catch (const std::exception& error) {
    throw std::runtime_error(error.what());
  }
}

}  // namespace lamina::bag
