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
  /// range_max without the readings that mean no return; as stated where there are none such.
  double limited(double range_max) const {
    return code_ && (range_max <= 0 || *code_ < range_max) ? *code_ : range_max;
  }
  /// Recorded stamps by those that are used, where they differ and increase strictly.
  const std::map<Timestamp, Timestamp>& restamped() const { return restamped_; }
  const std::vector<Warning>& warnings() const { return warnings_; }
  const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  std::vector<std::optional<Timestamp>> recorded_, used_;  // of repeats: none
  std::vector<float> last_;
  std::optional<Timestamp> last_stamp_;
  NoReturnCode returns_;
  std::optional<double> code_;
  std::map<Timestamp, Timestamp> restamped_;
  std::vector<Warning> warnings_;
  std::vector<std::string> remarks_;
};

}  // namespace lamina
