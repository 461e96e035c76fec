// Joining by least range per beam.
#include <lamina/grid/evidence/scan_fusion.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/sensors/obstacle_scan.hpp>

namespace lamina {
namespace {

constexpr double kAnyHeight = 1e9;

bool identity(const SE3& T) { return T.log().norm() < 1e-9; }

}  // namespace

// The finer of the two lattices of beams.
LaserScan CombinedScan::in_body(const Seen& seen, const std::optional<Seen>& other) {
  const bool joined = other && std::abs(seen.scan.stamp - other->scan.stamp) <= kMaxAge;
  const bool even = seen.scan.angles.empty();
  if (!joined && even && identity(seen.scan.lidar.T_body_lidar)) return seen.scan;
  double increment = std::abs(seen.scan.angle_increment);
  if (joined) increment = std::min(increment, std::abs(other->scan.angle_increment));
  ObstacleScan base = ObstacleScan::empty(seen.scan.stamp, 0, increment, 1, seen.scan.range_max);
  base.range_min = seen.scan.range_min;
  ObstacleScan out = merge_scans(base, seen.scan, -kAnyHeight, kAnyHeight);
  if (joined) {
    LaserScan moved = other->scan;
    moved.lidar.T_body_lidar =
        seen.T_start_body.inverse() * other->T_start_body * moved.lidar.T_body_lidar;
    out = merge_scans(out, moved, -kAnyHeight, kAnyHeight);
  }
  LaserScan scan = out.to_laser_scan();
  scan.lidar = seen.scan.lidar;
  scan.lidar.T_body_lidar = SE3();
  return scan;
}

LaserScan CombinedScan::add(const LaserScan& scan, Kind kind, const SE3& T_start_body) {
  std::optional<Seen>& mine = kind == Kind::kLidar ? lidar_ : depth_;
  mine = Seen{scan, T_start_body};
  return in_body(*mine, kind == Kind::kLidar ? depth_ : lidar_);
}

}  // namespace lamina
