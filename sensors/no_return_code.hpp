// Which range a scanner writes where nothing came back.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lamina/models/warning.hpp>

namespace lamina {

struct NoReturnOptions {
  double bin = 0.01;      ///< m
  double furthest = 200;  ///< m, of the histogram; what is beyond counts as there
  std::size_t bins = 10;  ///< of a peak: SICK's codes 8183 to 8191 are 8 cm apart at 1 cm a unit
  /// m, and share of the beams: where fewer changed by more, the scan is the last one again.
  double moved = 0.05, moved_share = 0.05;
  double share = 0.005;       ///< of all readings that a code has at least
  double above = 0.02;        ///< of the code's readings that may be further: a wall goes on there
  double below = 0.2;         ///< of the code's readings that may lie up to `clear` nearer
  double clear = 0.5;         ///< m
  std::size_t enough = 2000;  ///< readings
  double scans = 0.2;         ///< share of the scans that have it: a wall is left behind
};

/// A peak of equal readings near the maximum, with nothing beyond and hardly anything before it, is
/// no wall: walls go on above their shortest distance, and come nearer or go as the robot moves:
/// scans as the last that counted are left out. Add scans of the whole recording.
class NoReturnCode {
 public:
  explicit NoReturnCode(const NoReturnOptions& options = {});
  /// Ranges (m) that passed for returns; others are left out.
  void add(std::span<const float> ranges);
  /// The shortest range (m) of the code; nullopt: there is none.
  std::optional<double> code() const;
  /// Share of the readings at `code` and beyond.
  double share_from(double code) const;
  /// What to say of it; `stated`: range_max of the recording (m), 0 where it states none.
  Warning warning(double code, double stated) const;

 private:
  bool moved(std::span<const float> ranges) const;

  NoReturnOptions options_;
  std::vector<std::size_t> readings_, scans_;  // by bin
  std::vector<std::size_t> last_scan_;
  std::size_t all_ = 0, scan_count_ = 0;
  std::vector<float> counted_;  ///< the last scan that counted
};

}  // namespace lamina
