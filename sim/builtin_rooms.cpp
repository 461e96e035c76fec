// Built-in worlds inside buildings: room, corridor_loop, office, long_corridor.
#include <cmath>

#include <lamina/sim/builtin.hpp>

namespace lamina::sim {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

/// Floor, four walls seen from inside, and a ceiling.
void add_shell(Scene& scene, const Rect& r, double height) {
  scene.add_ground("floor", PlaneLabel::kFloor, r, 0);
  scene.add_wall("wall.south", {r.x0, r.y0}, {r.x1, r.y0}, 0, height);
  scene.add_wall("wall.east", {r.x1, r.y0}, {r.x1, r.y1}, 0, height);
  scene.add_wall("wall.north", {r.x1, r.y1}, {r.x0, r.y1}, 0, height);
  scene.add_wall("wall.west", {r.x0, r.y1}, {r.x0, r.y0}, 0, height);
  scene.add_polygon(
      "ceiling", PlaneLabel::kCeiling,
      {{r.x0, r.y0, height}, {r.x0, r.y1, height}, {r.x1, r.y1, height}, {r.x1, r.y0, height}});
}

void add_block(Scene& scene, const std::string& name, const Rect& r, double height) {
  scene.add_box(name, SE3::from_translation({0.5 * (r.x0 + r.x1), 0.5 * (r.y0 + r.y1), 0}),
                {r.x1 - r.x0, r.y1 - r.y0, height}, PlaneLabel::kOther, PlaneLabel::kWall);
}

void add_furniture(Scene& scene, const std::string& name, double x, double y, double yaw_deg,
                   const Eigen::Vector3d& size) {
  scene.add_box(name, SE3::planar(x, y, yaw_deg * kDegree), size);
}

std::vector<Eigen::Vector3d> laps_of(const Rect& r, int laps) {
  std::vector<Eigen::Vector3d> points = {{0.5 * (r.x0 + r.x1), r.y0, 0}};
  for (int lap = 0; lap < laps; ++lap) {
    points.insert(points.end(),
                  {{r.x1, r.y0, 0}, {r.x1, r.y1, 0}, {r.x0, r.y1, 0}, {r.x0, r.y0, 0}});
    points.push_back(points.front());
  }
  return points;
}

RigDefaults indoor(double drift_deg_per_m) {
  RigDefaults d;
  d.lidar = true;
  d.camera_pitch_deg = 20;
  d.odometry_rotation = 0.01;
  d.odometry_drift_deg = drift_deg_per_m;
  return d;
}

}  // namespace

void build_room(Settings& s, World& world) {
  world.rig = make_rig(s, indoor(0.05));
  Scene& scene = world.scene;
  const double x = s.number("room.length_m", 7), y = s.number("room.width_m", 6);
  const double height = s.number("room.height_m", 2.8);
  add_shell(scene, {-x / 2, -y / 2, x / 2, y / 2}, height);
  add_furniture(scene, "table", 0, 0, 10, {1.4, 0.8, 0.74});
  add_furniture(scene, "cabinet", x / 2 - 0.3, y / 2 - 0.9, 0, {0.6, 1.6, 1.9});
  add_furniture(scene, "chest", -x / 2 + 0.35, -y / 2 + 0.5, 0, {0.5, 0.8, 0.6});
  add_furniture(scene, "crate", -x / 2 + 0.5, y / 2 - 0.5, 30, {0.4, 0.4, 0.35});
  const double path_x = x / 2 - 1.6, path_y = y / 2 - 1.4;
  world.path = Path::drive(laps_of({-path_x, -path_y, path_x, path_y}, s.integer("path.laps", 1)),
                           s.number("path.speed", 0.5), s.number("path.turn_rate", 0.8));
}

void build_corridor_loop(Settings& s, World& world) {
  RigDefaults defaults = indoor(0.2);
  defaults.odometry_scale = 1.015;
  defaults.camera_rate = 2;
  defaults.lidar_rate = 5;
  world.rig = make_rig(s, defaults);
  Scene& scene = world.scene;
  const double x = s.number("loop.length_m", 22), y = s.number("loop.width_m", 14);
  const double w = s.number("corridor.width_m", 2.2), height = 2.6;
  add_shell(scene, {0, 0, x, y}, height);
  add_block(scene, "core", {w, w, x - w, y - w}, height);
  // Door frames, pillars and cabinets: a bare corridor says nothing of motion along it.
  int index = 0;
  for (double at : {0.22, 0.41, 0.63, 0.86}) {
    const std::string n = std::to_string(index);
    const double a = w + at * (x - 2 * w), b = w + at * (y - 2 * w);
    add_block(scene, "pillar.south" + n, {a, 0, a + 0.3, 0.2 + 0.05 * index}, height);
    add_block(scene, "pillar.north" + n, {a - 0.8, y - 0.25, a - 0.3, y}, height);
    add_block(scene, "pillar.west" + n, {0, b, 0.2, b + 0.4}, height);
    add_block(scene, "pillar.east" + n, {x - 0.2 - 0.04 * index, b - 0.5, x, b}, height);
    ++index;
  }
  add_furniture(scene, "cabinet.a", x - 3.2, w - 0.25, 0, {1.0, 0.45, 1.1});
  add_furniture(scene, "cabinet.b", w - 0.25, y - 4, 0, {0.45, 1.2, 1.4});
  world.path = Path::drive(laps_of({w / 2, w / 2, x - w / 2, y - w / 2}, s.integer("path.laps", 2)),
                           s.number("path.speed", 1.0), s.number("path.turn_rate", 0.8));
}

namespace {

/// A wall of thickness 0.16 m along x at y (between x0 and x1) with a door 1 m wide in it.
void add_wall_with_door(Scene& scene, const std::string& name, double x0, double x1, double y,
                        double door, double height) {
  add_block(scene, name + ".a", {x0, y - 0.08, door - 0.5, y + 0.08}, height);
  add_block(scene, name + ".b", {door + 0.5, y - 0.08, x1, y + 0.08}, height);
}

}  // namespace

void build_office(Settings& s, World& world) {
  RigDefaults defaults = indoor(0.06);
  defaults.camera_rate = 2;
  defaults.lidar_rate = 5;
  world.rig = make_rig(s, defaults);
  Scene& scene = world.scene;
  const int rooms = s.integer("office.rooms_per_side", 5);
  const double w = 4.2, d = 4.5, hall = 2.2, height = 2.7, length = rooms * w;
  add_shell(scene, {0, -d - hall / 2, length, d + hall / 2}, height);
  std::vector<Eigen::Vector3d> points = {{0.9, 0, 0}};
  for (int i = 0; i < rooms; ++i) {
    for (int side : {1, -1}) {
      const std::string n = std::to_string(i) + (side > 0 ? "n" : "s");
      const double x0 = i * w, x1 = x0 + w, y0 = side * hall / 2, y1 = side * (d + hall / 2);
      const double door = x0 + 1.4 + 0.35 * ((2 * i + (side > 0 ? 1 : 0)) % 4);
      add_wall_with_door(scene, "wall.hall." + n, x0, x1, y0, door, height);
      if (i > 0) {
        const double low = std::min(y0, y1), high = std::max(y0, y1);
        add_block(scene, "wall.between." + n, {x0 - 0.08, low, x0 + 0.08, high}, height);
      }
      add_furniture(scene, "desk." + n, x1 - 0.6, y1 - side * 1.0, 0, {0.8, 1.6, 0.73});
      add_furniture(scene, "shelf." + n, x0 + 0.9, y1 - side * 0.3, 0, {1.2, 0.36, 1.8});
      if ((i + side) % 2 == 0) {
        add_furniture(scene, "crate." + n, x0 + 0.5, y0 + side * 0.9, 25.0 * i, {0.4, 0.5, 0.4});
      }
      points.insert(points.end(), {{door, 0, 0}, {door, side * (hall / 2 + 1.9), 0}, {door, 0, 0}});
    }
  }
  points.push_back({length - 0.9, 0, 0});
  points.push_back({0.9, 0, 0});
  world.path = Path::drive(points, s.number("path.speed", 0.8), s.number("path.turn_rate", 1.0));
}

void build_long_corridor(Settings& s, World& world) {
  RigDefaults defaults = indoor(0.01);
  defaults.camera_rate = 2;
  defaults.lidar_rate = 5;
  world.rig = make_rig(s, defaults);
  Scene& scene = world.scene;
  const double length = s.number("corridor.length_m", 120), w = s.number("corridor.width_m", 2.4);
  const double height = 2.6;
  add_shell(scene, {0, -w / 2, length, w / 2}, height);
  Random random(17, 0);
  int index = 0;
  for (double x = 4; x < length - 4; x += random.uniform(3, 7)) {
    const double side = index % 2 == 0 ? 1 : -1, deep = random.uniform(0.12, 0.3);
    const double y0 = side > 0 ? w / 2 - deep : -w / 2;
    add_block(scene, "pillar." + std::to_string(index++), {x, y0, x + 0.4, y0 + deep}, height);
  }
  const double speed = s.number("path.speed", 0.8), duration = s.number("path.duration_s", 3600);
  std::vector<Eigen::Vector3d> points = {{1.2, 0, 0}};
  // As many legs as fill the time; the turns come on top.
  const double leg = length - 2.4;
  for (double driven = 0; driven < duration * speed; driven += leg) {
    const bool out = points.size() % 2 == 1;
    const double part = std::min(leg, duration * speed - driven);
    points.push_back({out ? 1.2 + part : length - 1.2 - part, 0, 0});
  }
  world.path = Path::drive(points, speed, s.number("path.turn_rate", 0.8));
}

}  // namespace lamina::sim
