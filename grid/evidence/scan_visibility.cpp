// Beams about a bearing.
#include <lamina/grid/evidence/scan_visibility.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kOff = 0.02;     // m from the plane
constexpr double kMargin = 0.05;  // m, for errors of poses

// The first beam at an angle (rad) or after it.
std::ptrdiff_t beam_from(const LaserScan& scan, double angle) {
  if (scan.angles.empty()) {
    const auto end = static_cast<std::ptrdiff_t>(scan.size()) + 1;
    return to_whole<std::ptrdiff_t>(std::ceil((angle - scan.angle_min) / scan.angle_increment), 0,
                                    end);
  }
  return std::lower_bound(scan.angles.begin(), scan.angles.end(), static_cast<float>(angle)) -
         scan.angles.begin();
}

}  // namespace

Sight sight_of(const LaserScan& scan, const Eigen::Vector3d& p, double radius) {
  const double distance = p.head<2>().norm();
  if (std::abs(p.z()) > kOff || !(distance > radius) || !(scan.angle_increment > 0)) {
    return Sight::kUnknown;
  }
  const double half = std::asin(radius / distance);
  double angle = std::atan2(p.y(), p.x());
  const double turns = std::ceil((scan.angle_min - (angle - half)) / (2 * M_PI));
  if (!std::isfinite(turns)) return Sight::kUnknown;
  angle += 2 * M_PI * std::max(0.0, turns);
  const std::ptrdiff_t from = beam_from(scan, angle - half), to = beam_from(scan, angle + half);
  if (from >= to || to > static_cast<std::ptrdiff_t>(scan.size())) return Sight::kUnknown;
  const double margin = kMargin + 4 * scan.lidar.noise.range_sigma;
  bool past = true;
  for (auto k = static_cast<std::size_t>(from); k < static_cast<std::size_t>(to); ++k) {
    const double behind = static_cast<double>(scan.ranges[k]) - distance;
    if (scan.valid(k) && std::abs(behind) <= margin) return Sight::kMet;
    past = past && scan.valid(k) && behind > margin;
  }
  return past ? Sight::kPast : Sight::kUnknown;
}

}  // namespace lamina
