// Interpolates knots; turns way-points into knots.
#include <lamina/sim/path.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lamina::sim {
namespace {
constexpr double kPi = 3.14159265358979323846;
}

Path::Path(std::vector<Knot> knots, const Sway& sway) : knots_(std::move(knots)), sway_(sway) {}

Path Path::drive(const std::vector<Eigen::Vector3d>& points, double speed, double turn_rate,
                 const Sway& sway) {
  std::vector<Knot> knots;
  double time = 0, yaw = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Eigen::Vector3d step = points[i + 1] - points[i];
    const double flat = step.head<2>().norm();
    const double heading = flat > 1e-9 ? std::atan2(step.y(), step.x()) : yaw;
    const double pitch = flat > 1e-9 ? -std::atan2(step.z(), flat) : 0;
    const double turn = i == 0 ? 0 : std::remainder(heading - yaw, 2 * kPi);
    if (i == 0) {
      yaw = heading;
    } else if (std::abs(turn) > 1e-9) {
      time += std::abs(turn) / turn_rate;
      yaw += turn;
    }
    knots.push_back({time, points[i], yaw, pitch, 0});
    time += step.norm() / speed;
    knots.push_back({time, points[i + 1], yaw, pitch, 0});
  }
  return Path(std::move(knots), sway);
}

Path Path::stay(const SE3& T_map_body, double duration) {
  const Eigen::Matrix3d R = T_map_body.so3().matrix();
  Knot knot;
  knot.position_map = T_map_body.translation();
  knot.yaw = std::atan2(R(1, 0), R(0, 0));
  knot.pitch = -std::asin(std::clamp(R(2, 0), -1.0, 1.0));
  knot.roll = std::atan2(R(2, 1), R(2, 2));
  Knot end = knot;
  end.time = duration;
  return Path({knot, end});
}

SE3 Path::at(double time) const {
  if (knots_.empty()) {
    return SE3();
  }
  const auto after = std::upper_bound(knots_.begin(), knots_.end(), time,
                                      [](double t, const Knot& knot) { return t < knot.time; });
  const Knot& b = after == knots_.end() ? knots_.back() : *after;
  const Knot& a = after == knots_.begin() ? knots_.front() : *(after - 1);
  const double s = b.time > a.time ? std::clamp((time - a.time) / (b.time - a.time), 0.0, 1.0) : 0;
  Eigen::Vector3d position = a.position_map + s * (b.position_map - a.position_map);
  const double w = 2 * kPi / sway_.period;
  const double yaw = a.yaw + s * (b.yaw - a.yaw) + sway_.yaw * std::sin(w * time / 1.7);
  const double pitch = a.pitch + s * (b.pitch - a.pitch) + sway_.pitch * std::sin(w * time / 1.3);
  const double roll = a.roll + s * (b.roll - a.roll) + sway_.roll * std::sin(w * time);
  position.z() += sway_.height * std::sin(w * time / 2.1);
  return SE3(SO3::rot_z(yaw) * SO3::rot_y(pitch) * SO3::rot_x(roll), position);
}

}  // namespace lamina::sim
