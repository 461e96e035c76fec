// Bags as a recording.
#include <lamina/sensors/readers/bag_recording.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/depth_codes.hpp>
#include <lamina/sensors/intrinsics.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/bag_bodies.hpp>
#include <lamina/sensors/readers/bag_camera.hpp>
#include <lamina/sensors/readers/bag_frames.hpp>
#include <lamina/sensors/readers/bag_roles.hpp>
#include <lamina/sensors/readers/cloud_slice.hpp>
#include <lamina/sensors/readers/planar_odometry.hpp>
#include <lamina/sensors/readers/reorder_buffer.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/scan_checks.hpp>
#include <lamina/sensors/scan_stream.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {
using bag::folder_of, bag::is_empty, bag::kRawPerMetre, bag::to_se3;

BagRecording::BagRecording(std::string name, std::unique_ptr<bag::Source> source,
                           const RecordingOptions& options, bag::LiveSource* live)
    : name_(std::move(name)),
      options_(options),
      given_(options.calibration),
      source_(std::move(source)),
      live_(live) {
  if (const auto band = options_.topics.find("cloud_slice"); band != options_.topics.end())
    slice_ = parse_cloud_slice(band->second);
  given_.apply(calibration_);
  choose_topics();
  read_small_messages();
  look_over_scans();
  place_camera();
  if (live_) {
    go_live();
    return;
  }
  std::vector<std::string> frames;
  for (const char* role : {"scan", "depth", "cloud", "imu"}) {
    if (!topic_of(role).empty()) frames.push_back(topic_of(role));
  }
  source_->select(frames);
}

// The topic named by the settings, else the one with the most messages; the others are counted.
void BagRecording::choose(const char* role, std::vector<bag::Topic> candidates) {
  const auto wanted = options_.topics.find(role);
  if (wanted != options_.topics.end()) {
    const bool there = std::any_of(candidates.begin(), candidates.end(),
                                   [&](const auto& topic) { return topic.name == wanted->second; });
    if (!there) {
      std::string names;
      for (const auto& topic : candidates) names += (names.empty() ? "" : ", ") + topic.name;
      throw input_error(name_, "topic " + wanted->second, "no such topic for " + std::string(role),
                        names.empty() ? "a topic of that kind" : "one of " + names);
    }
    std::erase_if(candidates, [&](const auto& topic) { return topic.name != wanted->second; });
  }
  if (candidates.empty()) return;
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.count > b.count; });
  chosen_[role] = candidates.front().name;
  remarks_.push_back(std::string(role) + ": topic " + candidates.front().name);
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    skips_.add("topic not used: " + candidates[i].name, candidates[i].count);
  }
}

// Clouds are used where a setting names them, or where there is nothing else.
void BagRecording::choose_topics() {
  std::map<std::string, std::vector<bag::Topic>> by_role;
  for (const bag::Topic& topic : source_->topics()) {
    std::string role = bag::role_of_type(topic.type);
    if (!topic.unread.empty()) {
      if (!role.empty())
        skips_.add("topic not read: " + topic.name + " (" + topic.unread + ")", topic.count);
      continue;
    }
    if (role == "image") role = bag::holds_depth(*source_, topic.name) ? "depth" : "";
    if (role == "cloud" && slice_) role = "scan";
    if (role == "stream") skips_.add("stream not used: " + topic.name, topic.count);
    by_role[role].push_back(topic);
  }
  if (slice_ && options_.topics.count("scan") == 0)
    std::erase_if(by_role["scan"],
                  [](const auto& t) { return bag::role_of_type(t.type) != "cloud"; });
  for (const char* role : {"scan", "depth", "imu"}) choose(role, by_role[role]);
  const bool needed = topic_of("scan").empty() && topic_of("depth").empty();
  if (needed || options_.topics.count("cloud") > 0) {
    choose("cloud", by_role["cloud"]);
  } else {
    for (const auto& topic : by_role["cloud"])
      skips_.add("topic not used: " + topic.name, topic.count);
  }
  if (needed && topic_of("cloud").empty()) {
    throw input_error(
        name_, "", "no topic of scans, depth images or clouds",
        "sensor_msgs/LaserScan, Image (16UC1, 32FC1), CompressedImage (compressedDepth) or "
        "PointCloud2; it holds " +
            bag::list_of(source_->topics()));
  }
  for (const char* role : {"scan", "depth", "cloud"}) {
    for (const bag::Topic& topic : by_role[role]) {
      if (topic.name == topic_of(role)) expected_ += topic.count;
    }
  }
}

// Of the first scan, else of the first image or cloud.
std::string BagRecording::sensor_frame() {
  for (const char* role : {"scan", "depth", "cloud"}) {
    if (topic_of(role).empty()) continue;
    source_->select({topic_of(role)});
    bag::Message message;
    for (auto status = source_->next(message); status != bag::Source::Status::kEnd;
         status = source_->next(message)) {
      if (status != bag::Source::Status::kMessage) continue;
      if (message.kind == bag::Kind::kScan && is_empty(message)) continue;
      return frame_name(message.frame);
    }
  }
  return {};
}

void BagRecording::take(const bag::Message& m) {
  if (m.kind == bag::Kind::kCameraInfo) infos_.emplace(m.topic, m);
  if (m.kind != bag::Kind::kOdometry && m.kind != bag::Kind::kTransform) return;
  const Timestamp stamp = Timestamp::from_nanoseconds(m.stamp_ns);
  const auto pose = to_se3(m.pose);
  const std::string parent = frame_name(m.frame), child = frame_name(m.child_frame);
  const bool odometry = m.kind == bag::Kind::kOdometry || is_odometry_frame(parent);
  if (odometry && odometry_frame_.empty()) odometry_frame_ = parent;
  if (!pose) {
    skips_.add("pose that is no rigid motion");
  } else if (m.kind == bag::Kind::kOdometry) {
    bodies_.add_odometry(m.topic, child, {stamp, *pose});
  } else {
    bodies_.add_transform(parent, child, *pose, m.topic == "/tf_static", stamp);
  }
}

// Odometry, transforms and camera information come in full before the frames do.
void BagRecording::read_small_messages() {
  sensor_frame_ = sensor_frame();
  std::vector<std::string> topics;
  std::vector<bag::Topic> odometry;
  for (const bag::Topic& topic : source_->topics()) {
    if (!topic.unread.empty()) continue;
    const std::string role = bag::role_of_type(topic.type);
    if (role == "odom") odometry.push_back(topic);
    if (role == "odom" || role == "tf" || role == "camera_info") topics.push_back(topic.name);
  }
  const auto wanted = options_.topics.find("odom");
  if (wanted != options_.topics.end()) choose("odom", odometry);
  if (!topics.empty()) source_->select(topics);
  bag::Message m;
  for (auto status = bag::Source::Status::kMessage; !topics.empty();) {
    status = source_->next(m);
    if (status == bag::Source::Status::kEnd) break;
    if (status == bag::Source::Status::kMessage) take(m);
  }
  const bool asked = wanted != options_.topics.end();
  const auto chosen = bodies_.choose(sensor_frame_, asked ? wanted->second : "");
  if (!asked && !chosen.topic.empty()) {
    std::erase_if(odometry, [&](const bag::Topic& topic) {
      const bool other = topic.name != chosen.topic;
      if (other) skips_.add("topic not used: " + topic.name, topic.count);
      return other;
    });
    choose("odom", odometry);
  }
  choose_body(chosen);
}

void BagRecording::choose_body(const BagBodies::Chosen& chosen) {
  body_frame_ = chosen.frame;
  if (chosen.topic.empty() && !chosen.odometry.empty())
    remarks_.push_back("odom: transforms from frame odom");
  std::vector<Odometry> samples = chosen.odometry;
  go_on_over_steps(samples);
  track_ = OdometryTrack(samples);
  skips_.add(kSkipTimeBack, static_cast<std::int64_t>(track_.dropped()));
  settle_planar(track_.trajectory(), given_.states("odometry.planar"), calibration_, remarks_,
                warnings_);
  warnings_.insert(warnings_.end(), chosen.warnings.begin(), chosen.warnings.end());
  for (const char* frame : {"base_footprint", "base_link"}) {
    if (body_frame_.empty() && bodies_.tree().has(frame)) body_frame_ = frame;
  }
  remarks_.push_back(body_frame_.empty() ? "no body frame: sensors at the body's origin"
                                         : "body frame: " + body_frame_);
}

// Each scan by its own frame. What a calibration file says is of the first.
const LidarModel& BagRecording::scanner(const std::string& frame) {
  const auto known = lidars_.find(frame);
  if (known != lidars_.end()) return known->second;
  LidarModel model;
  const bool first = lidars_.empty();
  if (!first || !given_.states("lidar.T_body_lidar"))
    model.T_body_lidar = T_body(frame).value_or(SE3());
  if (first) given_.apply(model);
  if (slice_) {
    cloud_places_[frame] = model.T_body_lidar;
    model.T_body_lidar = slice_pose(model.T_body_lidar, *slice_);
  }
  if (first) {
    calibration_.lidar = model;
    if (!given_.states("lidar.range_sigma"))
      assumed_.push_back("lidar.range_sigma: " + default_range_sigma());
  }
  model.noise = calibration_.lidar->noise;
  if (lidars_.size() == 1) {
    warnings_.push_back({"two_scanners", "scans of topic " + topic_of("scan") +
                                             " come from frames '" + lidars_.begin()->first +
                                             "' and '" + frame +
                                             "': each is placed by its own transform"});
  }
  return lidars_.emplace(frame, model).first->second;
}

// The first places the scanner as soon as the bag is opened: settings depend on it. All of them say
// what of the stamps can be, and which range means no return.
void BagRecording::look_over_scans() {
  if (topic_of("scan").empty()) return;
  if (!sensor_frame_.empty()) scanner(sensor_frame_);
  source_->select({topic_of("scan")});
  bag::Message message;
  std::size_t count = 0;
  for (auto status = source_->next(message); status != bag::Source::Status::kEnd;
       status = source_->next(message)) {
    if (status != bag::Source::Status::kMessage) continue;
    slice_cloud(message);
    if (is_empty(message)) continue;
    Scans& scans = scans_[frame_name(message.frame)];
    scans.messages.push_back(++count);
    scans.stream.add(Timestamp::from_nanoseconds(message.stamp_ns), message.ranges,
                     static_cast<double>(message.range_min), static_cast<double>(message.range_max),
                     static_cast<double>(message.time_increment) *
                         static_cast<double>(message.ranges.size() - 1));
  }
  for (auto& [frame, scans] : scans_) {
    const auto place = [&, &messages = scans.messages](std::size_t i) {
      return topic_of("scan") + " message " + std::to_string(messages[i]);
    };
    scans.stream.finish(place, true);
    const auto& said = scans.stream.notes().remarks;
    remarks_.insert(remarks_.end(), said.begin(), said.end());
  }
}

std::optional<SE3> BagRecording::T_body(const std::string& frame) {
  if (const auto pose = bodies_.tree().lookup(body_frame_, frame_name(frame))) return pose;
  if (unplaced_.insert(frame).second) {
    remarks_.push_back(bodies_.tree().missing_link(body_frame_, frame_name(frame)));
    assumed_.push_back("sensor of frame '" + frame + "' at the body's origin: " + remarks_.back());
    if (!track_.empty())
      warnings_.push_back(place_assumed("the sensor of frame '" + frame + "'", remarks_.back()));
  }
  return std::nullopt;
}

const bag::Message* BagRecording::camera_info(const bag::Message& image) const {
  const auto wanted = options_.topics.find("camera_info");
  const std::string name =
      wanted != options_.topics.end() ? wanted->second : folder_of(image.topic) + "/camera_info";
  if (const auto it = infos_.find(name); it != infos_.end()) return &it->second;
  for (const auto& [topic, info] : infos_) {
    if (info.width == image.width && info.height == image.height) return &info;
  }
  return nullptr;
}

// By its first image, as soon as the bag is opened: what is asked of images depends on it.
void BagRecording::place_camera() {
  if (topic_of("depth").empty()) return;
  source_->select({topic_of("depth")});
  bag::Message message;
  for (auto status = source_->next(message); status != bag::Source::Status::kEnd;
       status = source_->next(message)) {
    if (status == bag::Source::Status::kMessage) return place_camera(message);
  }
}

void BagRecording::place_camera(const bag::Message& image) {
  bag::check_unit(image, warnings_);
  if (calibration_.depth_camera) return;
  const bool stated = given_.states("depth_camera.fx") && given_.states("depth_camera.fy");
  CameraModel camera = bag::camera_of(name_, image, camera_info(image), stated, warnings_);
  camera.T_body_camera = given_.states("depth_camera.T_body_camera")
                             ? SE3()
                             : T_body(image.frame).value_or(forward_looking_camera());
  calibration_.depth_camera = {camera, kRawPerMetre, DepthNoise::kinect(camera.fx)};
  given_.apply(*calibration_.depth_camera);
  const std::string wrong = senseless_intrinsics(calibration_.depth_camera->camera);
  if (!wrong.empty()) throw input_error(name_, image.topic, wrong, "a camera's intrinsics");
}

}  // namespace lamina
