// What a recording holds: for `lamina info`.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/models/skipped.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// One stream of a recording.
struct StreamInfo {
  std::int64_t count = 0;
  Timestamp first, last;
  double median_period_s = 0;  ///< between consecutive items; 0 below two items
  double longest_gap_s = 0;
  Timestamp gap_begin;    ///< of the longest
  std::int64_t gaps = 0;  ///< periods above three times the median
  double rate_hz() const { return median_period_s > 0 ? 1 / median_period_s : 0; }
};

/// Depth images or scans: how far they see and how much is missing.
struct RangeInfo {
  std::int64_t samples = 0, invalid = 0;            ///< pixels or beams
  double least_m = 0, median_m = 0, largest_m = 0;  ///< of the valid; median to 1 cm
  double invalid_share() const {
    return samples > 0 ? static_cast<double>(invalid) / static_cast<double>(samples) : 0;
  }
};

struct RecordingInfo {
  /// "depth", "stereo", "scan", "odometry", "rgb", ...; odometry as it was recorded.
  std::map<std::string, StreamInfo> streams;
  std::optional<RangeInfo> depth, scan;
  std::int64_t interpolated_odometry = 0;  ///< of the odometry: given at other sensors' times
  double odometry_path_m = 0;
  std::optional<Timestamp> first, last;
  Calibration calibration;
  SkippedCounts skipped;
  std::map<std::string, std::string> first_skipped;
  std::vector<std::string> remarks;
  std::vector<Warning> warnings;
};

/// Reads the whole recording once. Stereo pairs are counted, not matched.
RecordingInfo inspect(Recording& recording);

/// Streams that begin later or end earlier than the whole by more than a second and five of their
/// periods, in words.
std::vector<std::string> partial_streams(const RecordingInfo& info);

/// Aligned lines for people, ending in a newline.
std::string to_text(const RecordingInfo& info);

}  // namespace lamina
