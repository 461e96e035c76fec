// Beams brought to the time of the first one.
#include <lamina/frontend/motion/deskew.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

LaserScan straightened(LaserScan scan, double beam_time, const Vector6d& velocity) {
  if (scan.size() < 2 || beam_time == 0 || !velocity.allFinite()) return scan;
  double reach = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.valid(i)) reach = std::max(reach, static_cast<double>(scan.ranges[i]));
  }
  const double sweep = std::abs(beam_time) * static_cast<double>(scan.size() - 1);
  const double moved = sweep * (velocity.head<3>().norm() + reach * velocity.tail<3>().norm());
  constexpr double kWithinNoise = 0.1;  // of sigma
  if (moved < kWithinNoise * std::max(scan.lidar.noise.range_sigma, 1e-4)) return scan;

  const SE3& T_body_lidar = scan.lidar.T_body_lidar;
  // The same motion in the scanner's own tangent.
  const Vector6d per_beam = beam_time * (T_body_lidar.inverse().adjoint() * velocity);
  const double turn = per_beam(5);
  std::vector<float> angles(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double k = static_cast<double>(i), angle = scan.angle(i);
    angles[i] = static_cast<float>(angle + k * turn);
    if (!scan.valid(i)) continue;
    const Eigen::Vector2d p = scan.point(i);
    const Eigen::Vector3d q = SE3::exp(k * per_beam) * Eigen::Vector3d(p.x(), p.y(), 0);
    // On the side of the angle that was measured: a full turn stays one.
    angles[i] =
        static_cast<float>(angle + std::remainder(std::atan2(q.y(), q.x()) - angle, 2 * M_PI));
    scan.ranges[i] = static_cast<float>(q.head<2>().norm());
  }
  scan.angles = std::move(angles);
  return scan;
}

}  // namespace lamina
