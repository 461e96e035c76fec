// The text files of a dataset folder: image lists, scans.csv, TUM poses, accelerometer.txt. Lines
// that cannot be read are left out and counted; the rest stands.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/measurement.hpp>
#include <lamina/sensors/scan_stream.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {

/// One line of depth.txt, left.txt, ...
struct ListEntry {
  Timestamp stamp;
  std::string path;  ///< relative to the folder
};

/// What was done about the stamps of one file.
struct StreamClock {
  std::string name;  ///< the file's
  std::vector<Warning> warnings;
  std::vector<std::string> remarks;
  std::map<Timestamp, Timestamp> recorded;  ///< by used stamp, where these differ
};

/// `timestamp path` lines, in increasing time. With a clock, stamps that cannot be are replaced
/// (order_clocks); without, entries whose time goes back are left out and counted in `skips`. So do
/// the other readers here.
std::vector<ListEntry> parse_list(std::string_view text, SkipCounts& skips,
                                  StreamClock* clock = nullptr);

/// Where a scan stands in scans.csv: ranges are read when it is asked for.
struct ScanLine {
  Timestamp stamp;
  std::string_view line;
  int number = 0;  ///< of the line, from 1
};
/// Lines that read as scans, in the order of the file. Views point into `text`. Left out as cut: a
/// last line without an end that has fewer ranges than others of its angles and limits, and lines
/// that have fewer where that is rare (one such line, or one in ten): else a scanner's lengths
/// vary.
std::vector<ScanLine> index_scans(std::string_view text, SkipCounts& skips);
/// Likewise, with the stamps that are used, without repeats; what all scans say is in `stream`.
std::vector<ScanLine> index_scans(std::string_view text, SkipCounts& skips, ScanStream& stream);
/// One line of scans.csv; nullopt and the reason in `why` when it is none, and in `found` what
/// stands there, where the line itself does not show it.
std::optional<LaserScan> parse_scan_line(std::string_view line, std::string& why,
                                         std::string* found = nullptr);

/// TUM lines `timestamp tx ty tz qx qy qz qw`, in increasing time.
std::vector<Odometry> parse_odometry(std::string_view text, SkipCounts& skips,
                                     StreamClock* clock = nullptr);

/// `timestamp ax ay az` lines, in increasing time.
std::vector<Accelerometer> parse_accelerometer(std::string_view text, SkipCounts& skips);

}  // namespace lamina
