// First pass over a CARMEN log: where the scans stand, which of them to use, and which clock.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/no_return_code.hpp>
#include <lamina/sensors/readers/carmen_log.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {

/// A scan in the log; its ranges are read again when it is asked for.
struct CarmenScanEntry {
  std::string_view line;
  CarmenStamps stamps;
  std::optional<CarmenPose> robot;
  int number = 0;                     ///< of the line
  Timestamp stamp;                    ///< that is used
  std::optional<Timestamp> recorded;  ///< by the clock that is used
};

/// What the first pass learns of one kind of line from one device.
struct CarmenSource {
  CarmenTag tag;
  std::vector<CarmenScanEntry> entries;
  std::vector<SE3> mounts;  // T_robot_laser of each line that states both
  NoReturnCode code;
  float largest = 0;
  std::int64_t at_largest = 0, readings = 0;

  void add(const CarmenScan& scan, std::string_view line, int number);
  /// The largest reading is frequent: it means no return.
  bool saturates() const;
};

struct CarmenParam {
  double value = 0;
};

struct CarmenIndex {
  std::vector<CarmenSource> sources;  ///< at most one front and one rear laser
  std::vector<CarmenOdom> odoms;
  std::map<std::string, CarmenParam> params;  ///< PARAM lines with a number, by name
  bool use_logger = false;                    ///< the logger's clock, not the senders'
  SkipCounts skips;
};

SE3 to_se3(const CarmenPose& pose);

/// Indexes a log. Entries view `text`, which must outlive the result; they have no times yet
/// (apply_carmen_clock).
CarmenIndex index_carmen(std::string_view text);

}  // namespace lamina
