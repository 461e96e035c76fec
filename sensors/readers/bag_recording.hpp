// Bags of ROS 1 and ROS 2 as a recording; opened by open_rosbag and open_ros2.
#pragma once

#include <memory>
#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/depth_codes.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/bag_bodies.hpp>
#include <lamina/sensors/readers/bag_live.hpp>
#include <lamina/sensors/readers/bag_messages.hpp>
#include <lamina/sensors/readers/cloud_slice.hpp>
#include <lamina/sensors/readers/reorder_buffer.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/scan_checks.hpp>
#include <lamina/sensors/scan_stream.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {

class BagRecording final : public Recording {
 public:
  /// `name` stands in messages. `live`: the same source, where it is a running robot's; what is
  /// asked of a whole recording is then asked of its first look.
  BagRecording(std::string name, std::unique_ptr<bag::Source> source,
               const RecordingOptions& options, bag::LiveSource* live = nullptr);

  std::optional<Measurement> next() override {
    while (true) {
      if (auto measurement = buffer_.pop()) return measurement;
      if (done_) return std::nullopt;
      bag::Message message;
      switch (source_->next(message)) {
        case bag::Source::Status::kEnd:
          done_ = true;
          push_odometry(std::nullopt);
          buffer_.finish();
          break;
        case bag::Source::Status::kDamaged:
          skips_.add("damaged message", 1, message.topic);
          break;
        case bag::Source::Status::kWrongFormat:
          skips_.add(kSkipWrongFormat);
          break;
        case bag::Source::Status::kMessage:
          convert(message);
          break;
      }
    }
  }
  std::optional<Measurement> next_light() override {
    light_ = true;
    return next();
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override;
  std::map<std::string, std::string> first_skipped() const override { return skips_.firsts(); }
  std::map<std::string, std::vector<Timestamp>> recorded_stamps() const override {
    return {{"odometry", track_.stamps()}};
  }
  std::map<Timestamp, Timestamp> restamped() const override;
  std::vector<std::string> remarks() const override { return remarks_; }
  std::vector<std::string> assumed() const override { return assumed_; }
  std::vector<Warning> warnings() const override;
  std::optional<std::int64_t> size_hint() const override {
    return live_ ? std::nullopt : std::optional(expected_);
  }
  /// Names of frames; empty where none is known.
  const std::string& odometry_frame() const { return odometry_frame_; }
  const std::string& body_frame() const { return body_frame_; }

 private:
  /// The topic of a role; "" where none was chosen.
  std::string topic_of(const std::string& role) const {
    const auto found = chosen_.find(role);
    return found == chosen_.end() ? std::string() : found->second;
  }
  void choose_topics();
  void choose(const char* role, std::vector<bag::Topic> candidates);
  void read_small_messages();
  void take(const bag::Message& m);
  std::string sensor_frame();
  const LidarModel& scanner(const std::string& frame);
  void look_over_scans();
  void choose_body(const BagBodies::Chosen& chosen);
  void place_camera();
  void place_camera(const bag::Message& image);
  void convert(bag::Message& message);
  void slice_cloud(bag::Message& message);
  void convert_scan(bag::Message& message);
  void convert_depth(bag::Message& message, Timestamp stamp);
  void convert_cloud(const bag::Message& message, Timestamp stamp);
  void convert_imu(const bag::Message& message, Timestamp stamp);
  void go_live();
  void add_live_odometry(const bag::Message& message);
  void push_odometry(std::optional<Timestamp> until);
  void push_frame(Measurement frame);
  std::optional<SE3> T_body(const std::string& frame);
  const bag::Message* camera_info(const bag::Message& image) const;

  std::string name_;
  RecordingOptions options_;
  CalibrationOverlay given_;
  std::unique_ptr<bag::Source> source_;
  bag::LiveSource* live_;  // of source_; null: a file
  Calibration calibration_;
  std::map<std::string, std::string> chosen_;  // role -> topic
  std::map<std::string, bag::Message> infos_;  // topic -> first CameraInfo
  BagBodies bodies_;
  std::string body_frame_, sensor_frame_;  // the latter: of the first scan, else image
  std::string odometry_frame_;
  std::map<std::string, LidarModel> lidars_;  // by frame
  OdometryTrack track_;
  std::set<Timestamp> odometry_given_;
  std::size_t next_odometry_ = 0;  // of the recorded ones
  SaturatedDepths saturated_;
  std::vector<Warning> warnings_;
  std::optional<Rectifier> rectifier_;
  ReorderBuffer buffer_;
  SkipCounts skips_;
  std::vector<std::string> remarks_, assumed_;
  // Scanners of one topic may scan at the same instants: each frame is a stream of its own.
  struct Scans {
    ScanStream stream;
    std::vector<std::size_t> messages;  // of the topic
    std::size_t next = 0;
  };
  std::map<std::string, Scans> scans_;  // by frame
  std::optional<Timestamp> last_scan_;
  std::optional<CloudSlice> slice_;
  std::map<std::string, SE3> cloud_places_;  // T_body_sensor of sliced clouds, by frame
  std::set<std::string> unplaced_;
  std::int64_t expected_ = 0;
  bool done_ = false;
  bool light_ = false;  // images are passed over
};

}  // namespace lamina
