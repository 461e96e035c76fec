// What of a bag is otherwise where it is a running robot.
#include <lamina/sensors/readers/bag_frames.hpp>
#include <lamina/sensors/readers/bag_recording.hpp>
#include <lamina/sensors/readers/bag_roles.hpp>
#include <lamina/sensors/readers/planar_odometry.hpp>

namespace lamina {

// The source gives frames in order: nothing is held back here.
void BagRecording::go_live() {
  std::vector<std::string> topics;
  for (const char* role : {"scan", "depth", "cloud", "imu", "odom"})
    if (!topic_of(role).empty()) topics.push_back(topic_of(role));
  if (topic_of("odom").empty())
    for (const bag::Topic& topic : source_->topics())
      if (bag::role_of_type(topic.type) == "tf") topics.push_back(topic.name);
  buffer_.finish();
  live_->go_live(topics);
}

// Of the topic that was chosen, else of the transforms from the odometry's frame to the body.
void BagRecording::add_live_odometry(const bag::Message& message) {
  const bool topic = message.kind == bag::Kind::kOdometry && message.topic == topic_of("odom");
  const bool transform = message.kind == bag::Kind::kTransform && topic_of("odom").empty() &&
                         is_odometry_frame(frame_name(message.frame)) &&
                         frame_name(message.child_frame) == body_frame_;
  if (!topic && !transform) return;
  const auto pose = bag::to_se3(message.pose);
  if (!pose) {
    skips_.add("pose that is no rigid motion");
  } else if (!track_.add({Timestamp::from_nanoseconds(message.stamp_ns), *pose})) {
    skips_.add(kSkipTimeBack);
  }
}

SkippedCounts BagRecording::skipped() const {
  SkippedCounts all = skips_.counts();
  if (!live_) return all;
  for (const auto& [why, count] : live_->skipped()) all[why] += count;
  return all;
}

std::map<Timestamp, Timestamp> BagRecording::restamped() const {
  std::map<Timestamp, Timestamp> all;
  if (live_ || !topic_of("depth").empty()) return all;
  for (const auto& [frame, scans] : scans_)
    all.insert(scans.stream.restamped().begin(), scans.stream.restamped().end());
  return all;
}

std::vector<Warning> BagRecording::warnings() const {
  std::vector<Warning> all = warnings_;
  for (const auto& [frame, scans] : scans_) add_warnings(all, scans.stream.notes().warnings);
  if (auto found = saturated_.warning()) all.push_back(*std::move(found));
  for (const std::string& problem : source_->problems()) all.push_back({"bag_damaged", problem});
  if (!live_) return all;
  for (Warning& found : live_->warnings()) all.push_back(std::move(found));
  if (calibration_.odometry.planar && !given_.states("odometry.planar") &&
      off_plane(track_.trajectory()).leaves())
    all.push_back({"odometry_planar",
                   "the odometry was level when the run began and was taken as that of a body on "
                   "a floor, but its heights or tilts vary since: the map may be wrong; state "
                   "odometry.planar: false in a calibration file"});
  return all;
}

}  // namespace lamina
