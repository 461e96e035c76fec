// Beams that did not come back: is what they crossed free?
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include <lamina/grid/grid_options.hpp>
#include <lamina/grid/occupancy_grid.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Whether beam i met nothing up to range_max, by the scan's own word [REP117]: +inf, range_max or
/// more, or 0, which many drivers write for it; and both beams beside it likewise: single ones are
/// failures. Never where no range_max is stated.
bool came_back_empty(const LaserScan& scan, std::size_t i);

/// What a recording shows of its scanners, by their range_max. Such a scanner clears up to
/// range_max where (1) it does return from things that far: one return in a thousand, and 20 at the
/// least, come from its last tenth; and (2) its empty beams do not go through what other scans
/// found solid: a twentieth of them at most.
class NoReturns {
 public:
  void add(const LaserScan& scan, const SE3& T_map_lidar);
  /// Whether the scanner of this range_max returns from walls up to it. `scanners`: all scans.
  bool free(double range_max, const OccupancyGrid& scanners) const;

 private:
  struct Ray {
    Eigen::Vector2d from_map, to_map;
  };
  struct Scanner {
    std::size_t returns = 0, far = 0;  // far: from the last tenth
    std::vector<Ray> rays;             // every `every`th empty beam
    std::size_t empty = 0, every = 1;
  };
  std::map<double, Scanner> scanners_;  // by range_max, m
};

}  // namespace lamina
