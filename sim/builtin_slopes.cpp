// Built-in worlds on more than one level: ramp.
#include <algorithm>
#include <cmath>
#include <functional>

#include <lamina/sim/builtin.hpp>

namespace lamina::sim {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

/// A robot with wheels 40 cm apart, over ground whose height is a function of x: the body is as
/// high as the middle between its axles, and slopes begin and end by degrees.
std::vector<Eigen::Vector3d> on_ground(const std::vector<Eigen::Vector2d>& points,
                                       const std::function<double(double)>& height) {
  constexpr double kHalfBase = 0.2, kPiece = 0.05;  // m
  std::vector<Eigen::Vector3d> out;
  const auto add = [&](const Eigen::Vector2d& p) {
    out.emplace_back(p.x(), p.y(), (height(p.x() - kHalfBase) + height(p.x() + kHalfBase)) / 2);
  };
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Eigen::Vector2d way = points[i + 1] - points[i];
    const int pieces = std::max(1, static_cast<int>(std::ceil(way.norm() / kPiece)));
    for (int k = 0; k < pieces; ++k) add(points[i] + way * k / pieces);
  }
  add(points.back());
  return out;
}

RigDefaults on_wheels() {
  RigDefaults d;
  d.lidar = true;
  d.camera_pitch_deg = 20;
  d.odometry_rotation = 0.01;
  d.odometry_drift_deg = 0.2;
  d.odometry_scale = 1.015;
  return d;
}

}  // namespace

void build_ramp(Settings& s, World& world) {
  world.rig = make_rig(s, on_wheels());
  Scene& scene = world.scene;
  const double slope = s.number("ramp.deg", 5) * kDegree, length = s.number("ramp.length_m", 6);
  const double foot = 6, head = foot + length, rise = length * std::tan(slope), end = head + 7;
  constexpr double kWalls = 3.5, kNarrow = 1.5;  // m
  scene.add_ground("floor.lower", PlaneLabel::kFloor, {-2, -4, foot, 4}, 0);
  scene.add_ground("floor.upper", PlaneLabel::kFloor, {head, -3, end, 3}, rise);
  scene.add_ramp("ramp", SE3::planar(foot, 0, 0), length, 2 * kNarrow, rise);
  const std::vector<Eigen::Vector2d> corners = {
      {-2, -4}, {foot, -4}, {foot, -kNarrow}, {head, -kNarrow}, {head, -3}, {end, -3},
      {end, 3}, {head, 3},  {head, kNarrow},  {foot, kNarrow},  {foot, 4},  {-2, 4}};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    scene.add_wall("wall." + std::to_string(i), corners[i], corners[(i + 1) % corners.size()], 0,
                   kWalls);
  }
  scene.add_box("crate.lower", SE3::planar(1.8, 2.9, 20 * kDegree), {0.8, 0.5, 0.7});
  scene.add_box("crate.upper", SE3(SO3::rot_z(-15 * kDegree), {head + 5.6, -2.2, rise}),
                {0.6, 0.6, 0.8});
  const std::vector<Eigen::Vector2d> way = {
      {0, -2},           {4, -2},         {4, 0}, {head + 1.5, 0}, {head + 5, 0}, {head + 5, 1.6},
      {head + 1.5, 1.6}, {head + 1.5, 0}, {3, 0}, {0, 1},          {0, -2}};
  const auto height = [&](double x) { return rise * std::clamp((x - foot) / length, 0.0, 1.0); };
  world.path = Path::drive(on_ground(way, height), s.number("path.speed", 0.5),
                           s.number("path.turn_rate", 0.8));
}

}  // namespace lamina::sim
