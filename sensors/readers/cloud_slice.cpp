// Nearest points by angle.
#include <lamina/sensors/readers/cloud_slice.hpp>

#include <charconv>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {

CloudSlice parse_cloud_slice(const std::string& text) {
  CloudSlice slice;
  const char* const end = text.data() + text.size();
  const auto low = std::from_chars(text.data(), end, slice.low);
  if (low.ec == std::errc() && low.ptr != end && *low.ptr == ',') {
    const auto high = std::from_chars(low.ptr + 1, end, slice.high);
    if (high.ec == std::errc() && high.ptr == end && slice.low < slice.high) return slice;
  }
  throw Error("topics.cloud_slice: found '" + text +
              "', expected LOW,HIGH in m above the floor, e.g. 0.2,0.6");
}

SE3 slice_pose(const SE3& T_body_sensor, const CloudSlice& slice) {
  const Eigen::Vector3d& at = T_body_sensor.translation();
  const Eigen::Vector3d ahead = T_body_sensor.so3() * Eigen::Vector3d::UnitX();
  return SE3(SO3::rot_z(std::atan2(ahead.y(), ahead.x())),
             {at.x(), at.y(), (slice.low + slice.high) / 2});
}

LaserScan slice_of(const std::vector<std::array<float, 3>>& points_sensor, const SE3& T_body_sensor,
                   const CloudSlice& slice) {
  LaserScan scan;
  scan.lidar.T_body_lidar = slice_pose(T_body_sensor, slice);
  const auto beams = static_cast<std::size_t>(std::lround(2 * M_PI / slice.step));
  scan.angle_increment = 2 * M_PI / static_cast<double>(beams);
  scan.angle_min = -M_PI;
  scan.range_min = slice.nearest;
  scan.range_max = slice.furthest;
  scan.ranges.assign(beams, 0);
  const SE3 T_lidar_sensor = scan.lidar.T_body_lidar.inverse() * T_body_sensor;
  for (const auto& [x, y, z] : points_sensor) {
    const Eigen::Vector3d p =
        T_lidar_sensor *
        Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
    const double range = p.head<2>().norm();
    if (!(range >= slice.nearest && range < slice.furthest)) continue;  // false for NaN
    if (!(std::abs(p.z()) <= (slice.high - slice.low) / 2)) continue;
    const double turn = std::round((std::atan2(p.y(), p.x()) + M_PI) / scan.angle_increment);
    float& kept = scan.ranges[static_cast<std::size_t>(turn) % beams];
    if (kept == 0 || range < static_cast<double>(kept)) kept = static_cast<float>(range);
  }
  return scan;
}

}  // namespace lamina
