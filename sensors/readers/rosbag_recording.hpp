// ROS 1 bags as a recording; opened by open_rosbag.
#pragma once

#include <filesystem>
#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/depth_codes.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/bag_bodies.hpp>
#include <lamina/sensors/readers/input_kind.hpp>
#include <lamina/sensors/readers/reorder_buffer.hpp>
#include <lamina/sensors/readers/rosbag_source.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/scan_checks.hpp>
#include <lamina/sensors/scan_stream.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {

class BagRecording final : public Recording {
 public:
  BagRecording(const std::filesystem::path& file, const RecordingOptions& options)
      : name_(file.string()), options_(options), given_(options.calibration), source_(open(name_)) {
    given_.apply(calibration_);
    choose_topics();
    read_small_messages();
    look_over_scans();
    place_camera();
    std::vector<std::string> frames;
    for (const char* role : {"scan", "depth", "imu"}) {
      if (chosen_.count(role) > 0) frames.push_back(chosen_[role]);
    }
    source_->select(frames);
  }

  std::optional<Measurement> next() override {
    while (true) {
      if (auto measurement = buffer_.pop()) return measurement;
      if (done_) return std::nullopt;
      bag::Message message;
      switch (source_->next(message)) {
        case bag::Source::Status::kEnd:
          done_ = true;
          buffer_.finish();
          break;
        case bag::Source::Status::kDamaged:
          skips_.add("damaged message");
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
  SkippedCounts skipped() const override { return skips_.counts(); }
  std::map<std::string, std::string> first_skipped() const override { return skips_.firsts(); }
  std::map<std::string, std::vector<Timestamp>> recorded_stamps() const override {
    return {{"odometry", track_.stamps()}};
  }
  std::map<Timestamp, Timestamp> restamped() const override {
    std::map<Timestamp, Timestamp> all;
    if (chosen_.count("depth") > 0) return all;
    for (const auto& [frame, scans] : scans_)
      all.insert(scans.stream.restamped().begin(), scans.stream.restamped().end());
    return all;
  }
  std::vector<std::string> remarks() const override { return remarks_; }
  std::vector<std::string> assumed() const override { return assumed_; }
  std::vector<Warning> warnings() const override {
    std::vector<Warning> all = warnings_;
    for (const auto& [frame, scans] : scans_) add_warnings(all, scans.stream.notes().warnings);
    if (auto found = saturated_.warning()) all.push_back(*std::move(found));
    return all;
  }
  std::optional<std::int64_t> size_hint() const override { return expected_; }

 private:
  static std::unique_ptr<bag::Source> open(const std::string& name) {
    try {
      return std::make_unique<bag::Source>(name);
    } catch (const std::runtime_error& error) {
      const std::string why = error.what();
      const InputKind kind = kind_of_bag(name, why.substr(0, why.find('\n')));
      throw input_error(name, "", kind.found, kind.advice);
    }
  }
  void choose_topics();
  void choose(const char* role, std::vector<bag::Topic> candidates);
  bool holds_depth(const std::string& topic);
  void read_small_messages();
  void take(const bag::Message& m);
  std::string sensor_frame();
  const LidarModel& scanner(const std::string& frame);
  void look_over_scans();
  void choose_body(const BagBodies::Chosen& chosen);
  void place_camera();
  void place_camera(const bag::Message& image);
  void convert(bag::Message& message);
  void convert_scan(bag::Message& message);
  void convert_depth(bag::Message& message, Timestamp stamp);
  void push_frame(Measurement frame);
  std::optional<SE3> T_body(const std::string& frame);
  const bag::Message* camera_info(const bag::Message& image) const;

  std::string name_;
  RecordingOptions options_;
  CalibrationOverlay given_;
  std::unique_ptr<bag::Source> source_;
  Calibration calibration_;
  std::map<std::string, std::string> chosen_;  // role -> topic
  std::map<std::string, bag::Message> infos_;  // topic -> first CameraInfo
  BagBodies bodies_;
  std::string body_frame_, sensor_frame_;     // the latter: of the first scan, else image
  std::map<std::string, LidarModel> lidars_;  // by frame
  OdometryTrack track_;
  std::set<Timestamp> odometry_given_;
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
  std::set<std::string> unplaced_;
  std::int64_t expected_ = 0;
  bool done_ = false;
  bool light_ = false;  // images are passed over
};

}  // namespace lamina
