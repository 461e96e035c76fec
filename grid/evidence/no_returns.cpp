// Returns from afar, and empty beams against walls.
#include <lamina/grid/evidence/no_returns.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/grid/evidence/open_sectors.hpp>

namespace lamina {
namespace {

constexpr double kFarthest = 0.9;      // of range_max
constexpr double kFarShare = 1e-3;     // of all returns
constexpr std::size_t kFarLeast = 20;  // returns
constexpr std::size_t kMostRays = 4096;
constexpr std::size_t kThrough = 20;  // one ray in so many may go through what is solid

bool is_empty(const LaserScan& scan, std::size_t i) {
  const auto r = static_cast<double>(scan.ranges[i]);
  return r == 0 || r >= scan.range_max ||
         r >= static_cast<double>(static_cast<float>(scan.range_max));
}

// Does what beam i met leave the scanner's range with the next one, away from beam `before`?
bool leaves_range(const LaserScan& scan, std::ptrdiff_t i, std::ptrdiff_t before) {
  const auto count = static_cast<std::ptrdiff_t>(scan.size());
  if (i < 0 || i >= count) return false;  // the scan ends: nobody looked
  const auto range = [&](std::ptrdiff_t k) {
    const bool there = k >= 0 && k < count && scan.valid(static_cast<std::size_t>(k));
    return there ? static_cast<double>(scan.ranges[static_cast<std::size_t>(k)]) : 0.0;
  };
  const double here = range(i), was = range(before) > 0 ? range(before) : here;
  return here + std::max(0.0, here - was) >= kFarthest * scan.range_max;
}

}  // namespace

std::vector<char> open_sectors(const LaserScan& scan) {
  std::vector<char> open(scan.size(), 0);
  if (!(scan.range_max > 0)) return open;
  for (std::size_t from = 0, to = 0; from < scan.size(); from = to + 1) {
    for (to = from; to < scan.size() && !scan.valid(to);) ++to;
    const auto first = static_cast<std::ptrdiff_t>(from), end = static_cast<std::ptrdiff_t>(to);
    if (!leaves_range(scan, first - 1, first - 2) || !leaves_range(scan, end, end + 1)) continue;
    for (std::size_t i = from; i < to; ++i) open[i] = came_back_empty(scan, i);
  }
  return open;
}

bool came_back_empty(const LaserScan& scan, std::size_t i) {
  if (!(scan.range_max > 0) || !is_empty(scan, i)) return false;
  const bool left = i == 0 || is_empty(scan, i - 1);
  const bool right = i + 1 >= scan.size() || is_empty(scan, i + 1);
  return left && right;
}

void NoReturns::add(const LaserScan& scan, const SE3& T_map_lidar) {
  if (!(scan.range_max > 0)) return;
  Scanner& scanner = scanners_[scan.range_max];
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.valid(i)) {
      ++scanner.returns;
      scanner.far += static_cast<double>(scan.ranges[i]) >= kFarthest * scan.range_max;
    } else if (came_back_empty(scan, i) && scanner.empty++ % scanner.every == 0) {
      const double a = scan.angle(i);
      const Eigen::Vector3d end(scan.range_max * std::cos(a), scan.range_max * std::sin(a), 0);
      scanner.rays.push_back({T_map_lidar.translation().head<2>(), (T_map_lidar * end).head<2>()});
    }
  }
  while (scanner.rays.size() > kMostRays) {  // every second one
    for (std::size_t k = 0; 2 * k < scanner.rays.size(); ++k) scanner.rays[k] = scanner.rays[2 * k];
    scanner.rays.resize((scanner.rays.size() + 1) / 2);
    scanner.every *= 2;
  }
}

bool NoReturns::free(double range_max, const OccupancyGrid& scanners) const {
  const auto at = scanners_.find(range_max);
  if (at == scanners_.end()) return false;
  const Scanner& scanner = at->second;
  const double far = static_cast<double>(scanner.far);
  if (scanner.far < kFarLeast || far < kFarShare * static_cast<double>(scanner.returns)) {
    return false;
  }
  std::size_t through = 0;
  for (const Ray& ray : scanner.rays) through += scanners.solid_between(ray.from_map, ray.to_map);
  return kThrough * through <= scanner.rays.size();
}

}  // namespace lamina
