// One time line for the streams of a recording: stamps where they can order it, else the order of
// its lines.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/stamp_series.hpp>

namespace lamina {

/// One kind of record; `lines` says where in the recording each stands (increasing), so that
/// records of different streams can be put in order. Streams of files of their own have none.
struct ClockStream {
  std::string name;  ///< for messages: "scans", "odometry"
  std::vector<std::optional<Timestamp>> stamps;
  std::vector<std::size_t> lines;
};

struct ClockOrderOptions {
  /// s between two records of the first stream where no stamp says it.
  double nominal_interval = 0.1;
  /// s that clocks of two streams may be apart before the order of lines is believed instead: far
  /// beyond what the calibration of clocks finds.
  double apart = 5;
  /// Share of a stream's stamps above which having replaced them is a warning, not a remark.
  double worth_saying = 0.01;
  /// The place of a line, for messages.
  std::function<std::string(std::size_t)> place = [](std::size_t line) {
    return std::to_string(line);
  };
};

struct OrderedClock {
  std::vector<std::vector<Timestamp>> stamps;  ///< of each stream, strictly increasing
  std::vector<Warning> warnings;
  std::vector<std::string> remarks;
};

/// Adds warnings; those of a cause that is there already are joined to it.
void add_warnings(std::vector<Warning>& to, const std::vector<Warning>& more);

/// `recorded` (by used stamp) where the recorded stamps of all `frames` (used stamps, in order)
/// increase strictly; else nothing.
std::map<Timestamp, Timestamp> where_increasing(const std::map<Timestamp, Timestamp>& recorded,
                                                std::span<const Timestamp> frames);

/// Streams whose stamps say nothing take theirs from the lines about them; if no stream has any,
/// lines stand evenly, `nominal_interval` from one record of the first stream to the next.
OrderedClock order_clocks(std::span<const ClockStream> streams,
                          const ClockOrderOptions& options = {});

}  // namespace lamina
