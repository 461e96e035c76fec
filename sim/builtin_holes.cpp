// Built-in worlds whose ground falls away: hole, hole_no_wall, stairs_down.
#include <cmath>

#include <lamina/sim/builtin.hpp>

namespace lamina::sim {
namespace {

RigDefaults low_level_camera() {
  RigDefaults d;
  d.camera_height = 0.30;
  d.camera_pitch_deg = 0;
  return d;
}

void hole(Settings& s, World& world, bool wall, double default_depth) {
  world.rig = make_rig(s, low_level_camera());
  Scene& scene = world.scene;
  const double size = s.number("hole.size_m", 2), near = s.number("hole.distance_m", 2);
  const Rect opening{near, -size / 2, near + size, size / 2};
  scene.add_ground("floor", PlaneLabel::kFloor, {-3, -5, 9, 5}, 0, {opening});
  scene.add_hole_walls("hole", opening, 0, s.number("hole.thickness_m", 0.2));
  const double depth = s.number("hole.depth_m", default_depth);
  if (depth > 0) {
    scene.add_ground("below", PlaneLabel::kOther, {-10, -12, 16, 12}, -depth);
  }
  if (s.flag("hole.wall", wall)) {
    const double x = s.number("hole.wall_m", near + size + 1.5);
    scene.add_wall("wall", {x, -5}, {x, 5}, 0, 2.5);
  }
  const double advance = s.number("path.advance_m", 1.2);
  world.path = advance > 0
                   ? Path::drive({{0, 0, 0}, {advance, 0, 0}}, s.number("path.speed", 0.2), 1)
                   : Path::stay(SE3(), s.number("path.duration_s", 4));
}

void add_railing(Scene& scene, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = (to - from).normalized();
  const double length = (to - from).norm(), spacing = 0.12;
  const Eigen::Vector3d axis(along.x(), along.y(), 0);
  scene.add_cylinder({"rail", {from.x(), from.y(), 1.0}, axis, 0.025, length});
  const int posts = static_cast<int>(std::floor(length / spacing));
  for (int i = 0; i <= posts; ++i) {
    const Eigen::Vector2d foot = from + along * (length * i / posts);
    scene.add_cylinder({"post",
                        {foot.x(), foot.y(), 0},
                        Eigen::Vector3d::UnitZ(),
                        i % 8 == 0 ? 0.02 : 0.008,
                        1.0});
  }
}

}  // namespace

void build_hole(Settings& s, World& world) { hole(s, world, true, 2.5); }

void build_hole_no_wall(Settings& s, World& world) { hole(s, world, false, 0); }

void build_stairs_down(Settings& s, World& world) {
  world.rig = make_rig(s, low_level_camera());
  Scene& scene = world.scene;
  const int steps = s.integer("stairs.steps", 12);
  const double rise = s.number("stairs.rise_m", 0.17), tread = s.number("stairs.tread_m", 0.28);
  const double width = s.number("stairs.width_m", 1.6), x0 = s.number("stairs.distance_m", 2.5);
  const double y = width / 2, x1 = x0 + steps * tread, bottom = -rise * steps;
  const Rect opening{x0, -y, x1, y};
  scene.add_ground("floor", PlaneLabel::kFloor, {-3, -4, x1 + 1.5, 4}, 0, {opening});
  for (int i = 0; i < steps; ++i) {
    const double x = x0 + i * tread, z = -rise * i;
    // Seen from the stair's foot; from above only the treads show.
    scene.add_wall("riser." + std::to_string(i), {x, y}, {x, -y}, z - rise, z);
    scene.add_ground("tread." + std::to_string(i), PlaneLabel::kStep, {x, -y, x + tread, y},
                     z - rise);
  }
  scene.add_wall("shaft.left", {x1, y}, {x0, y}, bottom, 0);
  scene.add_wall("shaft.right", {x0, -y}, {x1, -y}, bottom, 0);
  scene.add_wall("wall", {x1 + 1.5, -4}, {x1 + 1.5, 4}, 0, 2.5);
  scene.add_hole_edge({{x0, -y, 0}, {x0, y, 0}});
  scene.add_hole_edge({{x0, y, 0}, {x1, y, 0}});
  scene.add_hole_edge({{x1, -y, 0}, {x0, -y, 0}});
  scene.add_hole_edge({{x1, y, 0}, {x1, -y, 0}});
  if (s.flag("stairs.railing_front", true)) {
    add_railing(scene, {x0 - 0.05, -y}, {x0 - 0.05, y});
  }
  if (s.flag("stairs.railing_sides", true)) {
    add_railing(scene, {x0, y + 0.03}, {x1, y + 0.03});
    add_railing(scene, {x0, -y - 0.03}, {x1, -y - 0.03});
  }
  const double advance = s.number("path.advance_m", 1.2);
  world.path = advance > 0
                   ? Path::drive({{0, 0, 0}, {advance, 0, 0}}, s.number("path.speed", 0.2), 1)
                   : Path::stay(SE3(), s.number("path.duration_s", 4));
}

}  // namespace lamina::sim
