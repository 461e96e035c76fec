// A recording or a live device: measurements in time order.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lamina/models/skipped.hpp>
#include <lamina/models/warning.hpp>
#include <lamina/sensors/calibration.hpp>
#include <lamina/sensors/measurement.hpp>

namespace lamina {

/// Settings a reader may need; every one has a default that suits most recordings.
struct RecordingOptions {
  std::map<std::string, std::string> topics;  ///< ROS: role ("scan", "depth", "odom") -> topic
  std::optional<std::filesystem::path> calibration;  ///< what it states replaces what INPUT says
  double association_tolerance_s = 0.02;             ///< pairs left and right, depth and colour
};

/// Gives the measurements of a source in time order, all streams merged.
class Recording {
 public:
  virtual ~Recording() = default;
  /// The next measurement; nullopt at the end. Damaged items are skipped and counted.
  virtual std::optional<Measurement> next() = 0;
  /// The next depth image after passing over `skip` of them, and over all else; nullopt at the end.
  /// For a first look: sources that can do not decode what they pass over.
  virtual std::optional<DepthFrame> next_depth(std::int64_t skip);
  /// The next measurement but images and clouds. For a first look that ends there: sources that can
  /// decode none of these.
  virtual std::optional<Measurement> next_light();
  virtual const Calibration& calibration() const = 0;
  /// What was left out so far, by reason, e.g. {"missing file", 3}.
  virtual SkippedCounts skipped() const = 0;
  /// Where and what the first case of a reason was ("scans.csv:12: ..."), where a place is known.
  virtual std::map<std::string, std::string> first_skipped() const { return {}; }
  /// When colour images and poses of the odometry ("rgb", "odometry") were recorded, in order:
  /// next() gives none of the former, and the latter at other sensors' times, too.
  virtual std::map<std::string, std::vector<Timestamp>> recorded_stamps() const { return {}; }
  /// What no file or topic stated and was assumed for want of it: where sensors sit, noise.
  virtual std::vector<std::string> assumed() const { return {}; }
  /// Used stamps of scans and images that are not the recorded ones, with these; only where the
  /// recorded ones increase strictly over all that next() gives of them.
  virtual std::map<Timestamp, Timestamp> restamped() const { return {}; }
  /// Remarks for people: what was found, assumed or is odd.
  virtual std::vector<std::string> remarks() const { return {}; }
  /// What of the recording may make the map wrong, or is not as its files state; complete at the
  /// end.
  virtual std::vector<Warning> warnings() const { return {}; }
  /// How many measurements there will be, where the source can tell (for progress).
  virtual std::optional<std::int64_t> size_hint() const { return std::nullopt; }
  /// Likewise, how many depth images.
  virtual std::optional<std::int64_t> depth_hint() const { return std::nullopt; }
};

/// Opens what `input` names: a dataset folder, .oni, .log/.clf, .rawlog, .bag, .pcd, a folder of
/// .pcd, or `openni:`[URI]. Throws lamina::Error when it is none of these or cannot be read, or
/// when this build lacks the reader.
std::unique_ptr<Recording> open_recording(const std::string& input,
                                          const RecordingOptions& options = {});

}  // namespace lamina
