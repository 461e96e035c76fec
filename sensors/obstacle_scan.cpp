// Scans as values: combined, merged with a lidar's, written as returns and as edge points.
#include <lamina/sensors/obstacle_scan.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/checked_cast.hpp>
#include <lamina/models/error.hpp>

namespace lamina {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;

// An end of knowledge gives way to anything that was seen.
bool nearer(float range_a, BeamCause a, float range_b, BeamCause b) {
  if (a == BeamCause::kNone) return false;
  if (b == BeamCause::kNone) return true;
  const bool known_a = a != BeamCause::kEdgeOfKnowledge, known_b = b != BeamCause::kEdgeOfKnowledge;
  return known_a == known_b ? range_a < range_b : known_a;
}

void take(const ObstacleScan& from, std::size_t i, ObstacleScan& to, std::size_t k) {
  to.floor_range[k] = std::max(to.floor_range[k], from.floor_range[i]);
  if (!nearer(from.range[i], from.cause[i], to.range[k], to.cause[k])) return;
  to.range[k] = from.range[i];
  to.cause[k] = from.cause[i];
  to.sigma[k] = from.sigma[i];
  to.height[k] = from.height[i];
}

}  // namespace

const char* to_string(BeamCause cause) {
  constexpr const char* kNames[] = {"none", "obstacle", "hole", "ledge", "edge_of_knowledge"};
  return kNames[static_cast<int>(cause)];
}

int ObstacleScan::beam_of(double a) const {
  if (!(angle_increment > 0)) return -1;
  const double turn = 2 * kPi;
  double offset = a - angle_min;
  const double low = -0.5 * angle_increment;
  offset -= turn * std::floor((offset - low) / turn);
  const double i = std::floor(offset / angle_increment + 0.5);
  return i < static_cast<double>(size()) ? static_cast<int>(i) : -1;
}

ObstacleScan ObstacleScan::empty(Timestamp stamp, double angle_min, double angle_increment,
                                 std::size_t beams, double range_max) {
  ObstacleScan scan;
  scan.stamp = stamp;
  scan.angle_min = angle_min;
  scan.angle_increment = angle_increment;
  scan.range_max = range_max;
  scan.range.assign(beams, kNaN);
  scan.cause.assign(beams, BeamCause::kNone);
  scan.sigma.assign(beams, 0);
  scan.height.assign(beams, 0);
  scan.floor_range.assign(beams, 0);
  return scan;
}

LaserScan ObstacleScan::to_laser_scan(bool knowledge_is_return) const {
  LaserScan out;
  out.stamp = stamp;
  out.angle_min = angle_min;
  out.angle_increment = angle_increment;
  out.range_min = range_min;
  out.range_max = range_max;
  out.ranges = range;
  for (std::size_t i = 0; i < size(); ++i) {
    if (cause[i] == BeamCause::kEdgeOfKnowledge && !knowledge_is_return) out.ranges[i] = kNaN;
  }
  return out;
}

ObstacleScan combine(const ObstacleScan& a, const ObstacleScan& b) {
  LAMINA_CHECK(a.size() == b.size() && a.angle_min == b.angle_min &&
               a.angle_increment == b.angle_increment);
  ObstacleScan out = a;
  for (std::size_t i = 0; i < b.size(); ++i) take(b, i, out, i);
  out.range_min = std::min(a.range_min, b.range_min);
  out.range_max = std::max(a.range_max, b.range_max);
  return out;
}

ObstacleScan merge_scans(const ObstacleScan& depth, const LaserScan& lidar, double min_height,
                         double max_height) {
  const SE3& T = lidar.lidar.T_body_lidar;
  const double step = depth.size() > 0 && depth.angle_increment > 0
                          ? depth.angle_increment
                          : std::max(1e-4, std::abs(lidar.angle_increment));
  // Beams all around, on the depth scan's lattice.
  const double beams = std::floor(2 * kPi / step);
  const double before = std::floor((depth.angle_min + kPi) / step);
  ObstacleScan out = ObstacleScan::empty(depth.stamp, depth.angle_min - before * step, step,
                                         static_cast<std::size_t>(beams),
                                         std::max(depth.range_max, lidar.range_max));
  out.range_min = std::min(depth.range_min, lidar.range_min);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const int k = out.beam_of(depth.angle(i));
    if (k >= 0) take(depth, i, out, static_cast<std::size_t>(k));
  }
  const LidarNoise& noise = lidar.lidar.noise;
  const double half = 0.5 * std::abs(lidar.angle_increment);
  for (std::size_t i = 0; i < lidar.size(); ++i) {
    if (!lidar.valid(i)) continue;
    const Eigen::Vector2d flat = lidar.point(i);
    const Eigen::Vector3d p = T * Eigen::Vector3d(flat.x(), flat.y(), 0);
    if (p.z() < min_height || p.z() > max_height) continue;
    const double range = p.head<2>().norm(), angle = std::atan2(p.y(), p.x());
    // As wide, seen from the body's origin, as the lidar's beam is there.
    const double width = half * flat.norm() / std::max(range, 1e-6);
    const int spread = to_whole(width / step, 0, out.size() > 8 ? 50 : 0);
    for (int k = -spread; k <= spread; ++k) {
      const int beam = out.beam_of(angle + k * step);
      if (beam < 0) continue;
      const std::size_t b = static_cast<std::size_t>(beam);
      if (!nearer(static_cast<float>(range), BeamCause::kObstacle, out.range[b], out.cause[b]))
        continue;
      out.range[b] = static_cast<float>(range);
      out.cause[b] = BeamCause::kObstacle;
      out.sigma[b] = static_cast<float>(std::hypot(noise.range_sigma, noise.range_floor));
      out.height[b] = 0;
    }
  }
  return out;
}

std::vector<EdgePoint> edge_points(const ObstacleScan& scan, const SE3& T_map_body) {
  std::vector<EdgePoint> out;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const bool negative = is_negative(scan.cause[i]);
    const bool knowledge = scan.cause[i] == BeamCause::kEdgeOfKnowledge;
    if (!negative && !knowledge) continue;
    const double r = static_cast<double>(scan.range[i]), a = scan.angle(i);
    const Eigen::Vector3d p(r * std::cos(a), r * std::sin(a), static_cast<double>(scan.height[i]));
    out.push_back({T_map_body * p, static_cast<double>(scan.sigma[i]), negative});
  }
  return out;
}

}  // namespace lamina
