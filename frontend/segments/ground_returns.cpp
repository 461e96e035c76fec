// Each beam's slope in the body against the height it starts from.
#include <lamina/frontend/segments/ground_returns.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace lamina {
namespace {

constexpr double kLeastHeight = 0.05;  // m
constexpr double kLeastSlope = 0.02, kMostUncertainty = 0.02, kUncertainty = 1.0 / 3;

}  // namespace

int remove_ground(LaserScan& scan) {
  const double height = scan.lidar.T_body_lidar.translation().z();
  if (!(height >= kLeastHeight)) return 0;
  // A beam at angle a rises by this much a metre.
  const Eigen::Vector3d up_lidar =
      scan.lidar.T_body_lidar.so3().inverse() * Eigen::Vector3d::UnitZ();
  if (!(std::hypot(up_lidar.x(), up_lidar.y()) >= kLeastSlope)) return 0;
  std::vector<std::size_t> ground;
  std::size_t beyond = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!scan.valid(i)) continue;
    const double a = scan.angle(i);
    const double slope = -(up_lidar.x() * std::cos(a) + up_lidar.y() * std::sin(a));
    if (slope < kLeastSlope) continue;
    const double check_match = std::min(kMostUncertainty, kUncertainty * slope);
    const double range = static_cast<double>(scan.ranges[i]);
    if (range * (slope + check_match) < height) continue;
    ground.push_back(i);
    beyond += range * (slope - check_match) > height ? 1 : 0;
  }
  if (3 * beyond > ground.size()) return 0;
  for (const std::size_t i : ground) scan.ranges[i] = std::numeric_limits<float>::quiet_NaN();
  return static_cast<int>(ground.size());
}

}  // namespace lamina
