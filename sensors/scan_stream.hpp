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
  /// `sweep` (s): how long the scan took as the recording states it; 0 where it does not.
  void add(Timestamp stamp, const std::vector<float>& ranges, double range_min, double range_max,
           double sweep = 0);
  /// `place`: of the k-th scan added, for messages. `sorts`: the reader puts scans in order by
  /// their stamps, so that scans that came late keep theirs.
  void finish(const std::function<std::string(std::size_t)>& place, bool sorts = false);

  /// The time of the k-th scan added; nullopt where it repeats the one before within a moment.
  std::optional<Timestamp> stamp(std::size_t k) const {
    return k < used_.size() ? used_[k] : std::nullopt;
  }
  /// Readings that mean no return become infinite, those of another unit metres.
  void correct(LaserScan& scan) const;
  /// Of what its reader found, once finished.
  void warn(const std::vector<Warning>& more) { add_warnings(notes_.warnings, more); }
  /// Recorded stamps by those that are used, where they differ and increase strictly.
  const std::map<Timestamp, Timestamp>& restamped() const { return restamped_; }
  /// False for a scan that is stated to take longer than from one to the next.
  bool sweep_can_be(double sweep) const { return sweep <= longest_sweep_; }
  /// What to say of it all.
  struct Notes {
    std::vector<Warning> warnings;
    std::vector<std::string> remarks;
  };
  const Notes& notes() const { return notes_; }

 private:
  void check_sweep();
  void check_unit();

  std::vector<std::optional<Timestamp>> recorded_, used_;  // of repeats: none
  std::vector<float> last_;
  std::optional<Timestamp> last_stamp_;
  NoReturnCode returns_;
  std::optional<double> code_;
  std::map<Timestamp, Timestamp> restamped_;
  std::vector<double> sweeps_;  ///< s, as stated
  double longest_sweep_ = 1;    ///< s that a scan can take
  struct Reach {
    std::size_t readings = 0, beyond = 0;  ///< beyond: further than any scanner reaches
    float furthest = 0;
    void add(float range);
  };
  Reach within_, any_;  ///< readings up to range_max, and all
  double unit_ = 1;     ///< m that a reading of 1 is
  Notes notes_;
};

}  // namespace lamina
