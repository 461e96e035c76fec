// What all scans of a recording say together: their times, repeats, and the range of no return.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/sensors/clock_order.hpp>
#include <lamina/sensors/laser_scan.hpp>
#include <lamina/sensors/no_return_code.hpp>

namespace lamina {

/// Add scans in the order in which they were written, then finish().
class ScanStream {
 public:
  void add(Timestamp stamp, const std::vector<float>& ranges, double range_min, double range_max);
  /// `place`: of the k-th scan added, for messages.
  void finish(const std::function<std::string(std::size_t)>& place);

  /// The time of the k-th scan added; nullopt where it repeats the one before within a moment.
  std::optional<Timestamp> stamp(std::size_t k) const {
    return k < used_.size() ? used_[k] : std::nullopt;
  }
  /// Readings that mean no return become infinite.
  void take_out_codes(std::vector<float>& ranges) const;
  /// Recorded stamps by those that are used, where they differ and increase strictly.
  const std::map<Timestamp, Timestamp>& restamped() const { return restamped_; }
  /// What to say of it all.
  struct Notes {
    std::vector<Warning> warnings;
    std::vector<std::string> remarks;
  };
  const Notes& notes() const { return notes_; }

 private:
  std::vector<std::optional<Timestamp>> recorded_, used_;  // of repeats: none
  std::vector<float> last_;
  std::optional<Timestamp> last_stamp_;
  NoReturnCode returns_;
  std::optional<double> code_;
  std::map<Timestamp, Timestamp> restamped_;
  Notes notes_;
};

}  // namespace lamina
