// Built-in worlds for a scanner that is not level: flyover, roof_ridge, lost_altitude, lost_roll
// from the air, side_laser on the ground.
#include <cmath>

#include <lamina/sim/builtin.hpp>

namespace lamina::sim {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

RigDefaults aircraft() {
  RigDefaults d;
  d.depth = false;
  d.lidar = true;
  d.lidar_height = 0;
  d.lidar_pitch_deg = 90;  // the fan hangs down, across the flight
  d.lidar_fov_deg = 120;
  d.lidar_range = 150;
  d.lidar_sigma = 0.03;
  d.lidar_beams = 481;
  d.odometry_rate = 10;
  d.odometry_sigma = 0.05;
  d.odometry_rotation = 0.002;
  d.planar = false;
  return d;
}

Sway sway_of(Settings& s, double roll_deg, double pitch_deg, double height) {
  Sway sway;
  sway.roll = s.number("sway.roll_deg", roll_deg) * kDegree;
  sway.pitch = s.number("sway.pitch_deg", pitch_deg) * kDegree;
  sway.yaw = s.number("sway.yaw_deg", pitch_deg) * kDegree;
  sway.height = s.number("sway.height_m", height);
  sway.period = s.number("sway.period_s", 5);
  return sway;
}

void lost(Settings& s, World& world, const OdometryFault& fault) {
  RigDefaults defaults = aircraft();
  defaults.lidar_pitch_deg = 45;
  defaults.lidar_range = 300;
  defaults.lidar_rate = defaults.odometry_rate = 1;
  defaults.odometry_sigma = 0.01;
  defaults.odometry_rotation = 0.0005;
  world.rig = make_rig(s, defaults);
  world.scene.add_ground("ground", PlaneLabel::kFloor, {-400, -400, 600, 400}, 0);
  const double altitude = s.number("flight.altitude_m", 60), speed = s.number("flight.speed", 5);
  const int good = s.integer("lost.good_poses", 3), poses = s.integer("lost.poses", 13);
  OdometryFault at = fault;
  at.time = good / world.rig.odometry->rate_hz - 1e-6;
  world.rig.odometry->errors.faults.push_back(at);
  const double length = speed * (poses - 1) / world.rig.odometry->rate_hz;
  world.path = Path::drive({{0, 0, altitude}, {length, 0, altitude}}, speed, 1);
}

}  // namespace

void build_flyover(Settings& s, World& world) {
  RigDefaults defaults = aircraft();
  world.rig = make_rig(s, defaults);
  Scene& scene = world.scene;
  scene.add_ground("ground", PlaneLabel::kFloor, {-100, -150, 500, 150}, 0);
  // Buildings under the track show two roofs; beside it two walls more when turned, one when not.
  // With the ground: 5 x 2 + 10 x 4 + 1 x 3 + 1 = 54 planes.
  Random random(54, 0);
  for (int i = 0; i < 5; ++i) {
    House g;
    g.x = 25 + 45.0 * i;
    g.yaw_deg = random.uniform(-70, 70);
    g.pitch_deg = random.uniform(20, 40);
    scene.add_house("under" + std::to_string(i), g);
  }
  for (int i = 0; i < 10; ++i) {
    House g;
    g.x = 15 + 45.0 * (i / 2) + random.uniform(-3, 3);
    g.y = (i % 2 == 0 ? 1 : -1) * random.uniform(24, 28);
    g.yaw_deg = (i % 3 == 0 ? -1 : 1) * random.uniform(20, 65);
    g.pitch_deg = random.uniform(18, 35);
    g.eaves = random.uniform(4, 6);
    scene.add_house("beside" + std::to_string(i), g);
  }
  House straight;
  straight.x = 250;
  straight.y = 25;
  scene.add_house("straight", straight);
  const double altitude = s.number("flight.altitude_m", 40), speed = s.number("flight.speed", 8);
  const double end = s.number("flight.length_m", 290);
  world.path =
      Path::drive({{-15, 0, altitude}, {end - 15, 0, altitude}}, speed, 0.3, sway_of(s, 3, 2, 0.5));
}

void build_roof_ridge(Settings& s, World& world) {
  world.rig = make_rig(s, aircraft());
  const double off = s.number("ridge.off_deg", 0);
  world.scene.add_ground("ground", PlaneLabel::kFloor, {-100, -100, 150, 100}, 0);
  House g;
  g.x = 40;
  g.yaw_deg = 90 + off;  // the ridge lies across the flight
  g.length = s.number("ridge.length_m", 24);
  g.width = s.number("ridge.width_m", 14);
  g.pitch_deg = s.number("ridge.pitch_deg", 30);
  world.scene.add_house("house", g);
  const double altitude = s.number("flight.altitude_m", 30), speed = s.number("flight.speed", 5);
  world.path = Path::drive({{0, 0, altitude}, {80, 0, altitude}}, speed, 0.3, sway_of(s, 0, 0, 0));
}

void build_side_laser(Settings& s, World& world) {
  RigDefaults defaults;
  defaults.depth = false;
  defaults.lidar = true;
  defaults.lidar_height = 0.6;
  // The fan stands upright on the left, across the drive: angle 0 looks left, +90 degrees up.
  defaults.lidar_yaw_deg = defaults.lidar_roll_deg = 90;
  defaults.lidar_fov_deg = 180;
  defaults.lidar_beams = 361;
  defaults.odometry_rotation = 0.01;
  world.rig = make_rig(s, defaults);
  Scene& scene = world.scene;
  scene.add_ground("ground", PlaneLabel::kFloor, {-40, -40, 70, 60}, 0);
  // A court driven round clockwise, houses on all four sides of it.
  const double yaws[] = {93, -2, 88, 1};
  const Eigen::Vector2d centres[] = {{-11, 9}, {14, 29}, {39, 9}, {14, -11}};
  for (int i = 0; i < 4; ++i) {
    House house;
    house.x = centres[i].x();
    house.y = centres[i].y();
    house.yaw_deg = yaws[i];
    house.length = i % 2 == 0 ? 22 : 30;
    house.eaves = 4 + 0.5 * i;
    house.pitch_deg = 40;
    scene.add_house("house" + std::to_string(i), house);
  }
  // Low walls, steps and a sloped bank before the facades.
  const Eigen::Vector3d boxes[] = {{-4, 5, 0}, {-4, 13, 0}, {8, 22, 0}, {20, 21, 0}, {32, 6, 0}};
  for (std::size_t i = 0; i < std::size(boxes); ++i) {
    const SE3 T_map_box(SO3::rot_z(0.3 * static_cast<double>(i)), boxes[i]);
    scene.add_box("box" + std::to_string(i), T_map_box, {2.5, 1.2, 0.5 + 0.3 * double(i)});
  }
  scene.add_ramp("bank", SE3(SO3::rot_z(-M_PI / 2), {14, -2, 0}), 2.5, 6, 1.2);
  const double speed = s.number("drive.speed", 1);
  world.path = Path::drive({{0, 0, 0}, {0, 18, 0}, {28, 18, 0}, {28, 0, 0}, {0, 0, 0}}, speed, 0.5);
}

void build_lost_altitude(Settings& s, World& world) {
  OdometryFault fault;
  fault.translation_odom.z() = s.number("lost.altitude_m", 50);
  lost(s, world, fault);
}

void build_lost_roll(Settings& s, World& world) {
  OdometryFault fault;
  fault.rotation_body.x() = s.number("lost.roll_deg", 22) * kDegree;
  lost(s, world, fault);
}

}  // namespace lamina::sim
