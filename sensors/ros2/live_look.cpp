// Gathers transforms and camera information of the first look.
#include <lamina/sensors/ros2/live_look.hpp>

#include <lamina/sensors/readers/bag_bodies.hpp>
#include <lamina/sensors/readers/bag_frames.hpp>

namespace lamina::ros2 {

using bag::Kind;

void LiveLook::add(const std::string& role, const bag::Message& message) {
  seen_[message.topic] = true;
  const bool frame =
      message.kind == Kind::kScan || message.kind == Kind::kDepth || message.kind == Kind::kCloud;
  if (frame && frames_.count(message.topic) == 0) {
    bag::Message& kept = frames_[message.topic];
    kept.kind = message.kind;
    kept.topic = message.topic;
    kept.frame = message.frame;
    kept.width = message.width;
    kept.height = message.height;
  }
  const bool small = role == "odom" || role == "tf" || role == "camera_info";
  if (small && message.kind != Kind::kOther) small_.push_back(message);
  const bool odometry = message.kind == Kind::kOdometry ||
                        (message.kind == Kind::kTransform && frame_name(message.frame) == "odom");
  if (odometry && odometry_frame_.empty()) odometry_frame_ = frame_name(message.frame);
}

std::vector<std::string> LiveLook::missing() const {
  BagBodies bodies;
  std::vector<const bag::Message*> infos;
  for (const bag::Message& m : small_) {
    if (m.kind == Kind::kCameraInfo) infos.push_back(&m);
    const auto pose = bag::to_se3(m.pose);
    if (!pose || m.kind == Kind::kCameraInfo) continue;
    const Timestamp stamp = Timestamp::from_nanoseconds(m.stamp_ns);
    const std::string parent = frame_name(m.frame), child = frame_name(m.child_frame);
    if (m.kind == Kind::kOdometry) bodies.add_odometry(m.topic, child, {stamp, *pose});
    if (m.kind == Kind::kTransform)
      bodies.add_transform(parent, child, *pose, m.topic == "/tf_static", stamp);
  }
  std::vector<std::string> all;
  for (const auto& [topic, frame] : frames_) {
    const std::string name = frame_name(frame.frame);
    std::string body = bodies.choose(name, "").frame;
    for (const char* usual : {"base_footprint", "base_link"})
      if (body.empty() && bodies.tree().has(usual)) body = usual;
    if (!bodies.tree().lookup(body, name)) all.push_back("transforms to '" + name + "'");
    if (frame.kind != Kind::kDepth) continue;
    const std::string folder = bag::folder_of(topic) + "/camera_info";
    const bool there = std::any_of(infos.begin(), infos.end(), [&](const bag::Message* info) {
      return info->topic == folder || (info->width == frame.width && info->height == frame.height);
    });
    if (!there) all.push_back("camera information of " + topic);
  }
  return all;
}

}  // namespace lamina::ros2
