// A dataset folder (TUM RGB-D layout and more) as a recording; opened by open_dataset_folder.
#pragma once

#include <array>
#include <filesystem>
#include <fstream>

#include <lamina/sensors/depth_codes.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/text_streams.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/scan_stream.hpp>
#include <lamina/sensors/skip_counts.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {

class DatasetRecording final : public Recording {
 public:
  DatasetRecording(const std::filesystem::path& folder, const RecordingOptions& options);

  std::optional<Measurement> next() override {
    while (position_ < items_.size()) {
      const Item& item = items_[position_++];
      std::optional<Measurement> result = read(item);
      if (!result) continue;
      if (item.stream > Stream::kOdometry) ++frames_;
      return result;
    }
    if (frames_ == 0 && expects_frames_) fail_nothing_usable();
    return std::nullopt;
  }
  std::optional<DepthFrame> next_depth(std::int64_t skip) override {
    while (position_ < items_.size()) {
      const Item& item = items_[position_++];
      if (item.stream != Stream::kDepth || skip-- > 0) continue;
      auto result = read(item);
      if (result) return std::get<DepthFrame>(*std::move(result));
    }
    return std::nullopt;
  }
  std::optional<Measurement> next_light() override {
    while (position_ < items_.size()) {
      const Item& item = items_[position_++];
      if (item.stream == Stream::kDepth || item.stream == Stream::kStereo) continue;
      if (auto result = read(item)) return result;
    }
    return std::nullopt;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return skips_.counts(); }
  std::map<std::string, std::string> first_skipped() const override { return skips_.firsts(); }
  std::map<std::string, std::vector<Timestamp>> recorded_stamps() const override {
    return {{"odometry", track_.stamps()}, {"rgb", colour_stamps_}};
  }
  std::map<Timestamp, Timestamp> restamped() const override;
  std::vector<std::string> assumed() const override {
    std::vector<std::string> all;
    for (const std::string& remark : calibration_.remarks)
      if (remark.find("assumed") != std::string::npos) all.push_back(remark);
    return all;
  }
  std::vector<std::string> remarks() const override { return remarks_; }
  std::vector<Warning> warnings() const override {
    std::vector<Warning> all = warnings_;
    if (auto found = saturated_.warning()) all.push_back(*std::move(found));
    return all;
  }
  std::optional<std::int64_t> size_hint() const override {
    return static_cast<std::int64_t>(items_.size());
  }
  std::optional<std::int64_t> depth_hint() const override {
    return static_cast<std::int64_t>(depth_.size());
  }

 private:
  // At equal times in this order: what helps to interpret a frame comes before it.
  enum class Stream { kAccelerometer, kOdometry, kScan, kDepth, kStereo };

  struct Item {
    Timestamp stamp;
    Stream stream;
    std::size_t index;
  };

  // A scan's line in scans.csv: an hour of scans is a hundred megabytes, and each is asked for
  // once.
  struct ScanPlace {
    Timestamp stamp;
    std::streamoff begin;
    std::size_t size;
    int number;  // of the line
  };

  bool has(const char* name) const { return std::filesystem::exists(folder_ / name); }
  std::string text(const char* name) {
    skips_.set_source(std::string(name) + ":");
    return read_file_bytes(folder_ / name);
  }
  void read_poses();
  void read_scans();
  void read_depth_list(const RecordingOptions& options);
  void read_stereo_lists(const RecordingOptions& options);
  std::vector<ListEntry> read_list(const char* name, StreamClock* clock = nullptr);
  void fit_to_images(const std::string& path, const char* section, CameraModel& camera);
  void take(const std::vector<Warning>& warnings, const std::vector<std::string>& remarks,
            const std::map<Timestamp, Timestamp>& recorded);
  [[noreturn]] void fail_missing_section(const char* section, const char* file) const;
  [[noreturn]] void fail_nothing_usable() const;
  void schedule();
  void warn_of_empty_files();
  void count_unused();
  std::optional<Measurement> read(const Item& item);
  std::optional<Measurement> read_depth(const ListEntry& entry);
  std::optional<Measurement> read_stereo(std::size_t index);
  std::optional<Measurement> read_scan(const ScanPlace& place);
  void skip_image(const std::string& path, const std::string& why, const CameraModel& camera);

  std::filesystem::path folder_;
  Calibration calibration_;
  bool planar_stated_;
  std::vector<std::string> remarks_;
  std::vector<Warning> warnings_;
  std::map<Timestamp, Timestamp> restamped_;  // of scans and images: used stamp, recorded one
  ScanStream stream_;
  SkipCounts skips_;
  OdometryTrack track_;
  std::vector<Odometry> odometry_;
  std::vector<Accelerometer> accelerometer_;
  std::ifstream scans_file_;
  std::vector<ScanPlace> scans_;
  std::vector<ListEntry> depth_;
  std::vector<Timestamp> colour_stamps_;
  std::vector<std::array<ListEntry, 2>> stereo_;  // left, right
  SaturatedDepths saturated_;
  std::optional<Rectifier> depth_rectifier_, stereo_rectifier_;
  std::vector<Item> items_;
  std::size_t position_ = 0;
  std::int64_t frames_ = 0;
  bool expects_frames_ = false;
};

}  // namespace lamina
