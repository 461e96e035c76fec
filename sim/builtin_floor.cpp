// Built-in worlds on a floor: flat, steps, plates, obstacle_bed.
#include <cmath>
#include <cstdio>

#include <lamina/sim/builtin.hpp>

namespace lamina::sim {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

std::string centimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%gcm", metres * 100);
  return text;
}

/// Straight ahead along x from the origin; a robot that stays when there is nowhere to go.
Path advance(Settings& s, double distance, double speed, double stay) {
  distance = s.number("path.advance_m", distance);
  speed = s.number("path.speed", speed);
  if (!(distance > 0)) {
    return Path::stay(SE3(), s.number("path.duration_s", stay));
  }
  return Path::drive({{0, 0, 0}, {distance, 0, 0}}, speed, 1);
}

void platform(Scene& scene, const std::string& name, double x, double y, double yaw_deg,
              const Eigen::Vector3d& size) {
  scene.add_box(name, SE3::planar(x, y, yaw_deg * kDegree), size, PlaneLabel::kStep);
}

}  // namespace

void build_flat(Settings& s, World& world) {
  world.rig = make_rig(s, {});
  const double half = 0.5 * s.number("floor.size_m", 100);
  world.scene.add_ground("floor", PlaneLabel::kFloor, {-half, -half, half, half}, 0);
  world.path = advance(s, 5, 0.5, 5);
}

void build_steps(Settings& s, World& world) {
  world.rig = make_rig(s, {});
  Scene& scene = world.scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-3, -5, 14, 5}, 0);
  scene.add_wall("wall.end", {14, -5}, {14, 5}, 0, 2.5);
  scene.add_wall("wall.left", {14, 5}, {-3, 5}, 0, 2.5);
  scene.add_wall("wall.right", {-3, -5}, {14, -5}, 0, 2.5);
  const double size = s.number("steps.size_m", 1.2);
  const double heights[4] = {0.02, 0.03, 0.05, 0.10};
  for (int i = 0; i < 4; ++i) {
    platform(scene, "platform." + centimetres(heights[i]), 2.6 + 2.2 * (i / 2),
             i % 2 == 0 ? 1.2 : -1.2, 0, {size, size, heights[i]});
  }
  const double ramp = s.number("steps.ramp_deg", 5) * kDegree, length = 2;
  scene.add_ramp("ramp", SE3::planar(7.0, 1.2, 0), length, 1.2, length * std::tan(ramp));
  world.path = advance(s, 6, 0.4, 5);
}

void build_plates(Settings& s, World& world) {
  world.rig = make_rig(s, {});
  Scene& scene = world.scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-20, -20, 20, 20}, 0);
  const double side = s.number("plates.side_m", 0.2);
  const double thin = s.number("plates.thin_m", 0.01), thick = s.number("plates.thick_m", 0.02);
  int index = 0;
  for (double x : {1.0, 1.5, 2.0, 2.5, 3.0}) {
    // Side by side, a little apart from the middle, the further the wider.
    const double y = 0.16 + 0.06 * index;
    platform(scene, "plate." + centimetres(thin) + "." + std::to_string(index), x, y, 0,
             {side, side, thin});
    platform(scene, "plate." + centimetres(thick) + "." + std::to_string(index), x, -y, 0,
             {side, side, thick});
    ++index;
  }
  world.path = advance(s, 0.4, 0.1, 4);
}

void build_obstacle_bed(Settings& s, World& world) {
  world.rig = make_rig(s, {});
  Scene& scene = world.scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-10, -10, 15, 10}, 0);
  const double heights[] = {0.01, 0.02, 0.03, 0.05, 0.10, 0.20};
  int index = 0;
  for (double x : {1.2, 1.9, 2.6, 3.5, 4.5, 5.5}) {
    for (int side = 0; side < 3; ++side, ++index) {
      const double height = heights[(index + side) % 6];
      const double y = (side - 1) * (0.45 + 0.12 * x);
      const Eigen::Vector3d size(0.15 + 0.05 * (index % 3), 0.2 + 0.05 * (index % 2), height);
      platform(scene, "box." + centimetres(height) + "." + std::to_string(index), x, y,
               13.0 * (index % 5), size);
    }
  }
  index = 0;
  for (double slope_deg : {5.0, 10.0, 15.0, 25.0}) {
    const double side = index % 2 == 0 ? 1 : -1, x = 3.2 + 1.1 * (index / 2);
    const double length = 0.6;
    scene.add_ramp("slope." + std::to_string(static_cast<int>(slope_deg)) + "deg",
                   SE3::planar(x, 1.7 * side, 0), length, 0.6,
                   length * std::tan(slope_deg * kDegree));
    ++index;
  }
  world.path = advance(s, 1, 0.2, 5);
}

}  // namespace lamina::sim
