// Scenes, sensors, noise, and what every result must hold to.
#include "support/frontend_draws.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>

#include <lamina/frontend/depth/blocks.hpp>
#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/obstacles/coarse_depth.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/frontend/segments/segment_frontend.hpp>
#include <lamina/sim/caster.hpp>
#include <lamina/sim/depth_camera.hpp>
#include <lamina/sim/lidar.hpp>

namespace lamina {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Runs steps, times each, keeps the first promise that was not kept.
class Judge {
 public:
  template <class Step>
  auto step(const Step& run) {
    const double begin = thread_seconds();
    auto result = run();
    result_.longest_step_s = std::max(result_.longest_step_s, thread_seconds() - begin);
    return result;
  }
  void demand(bool promise, const char* text) {
    if (!promise && result_.broken.empty()) result_.broken = text;
  }
  void failed(const std::exception& error) { demand(false, error.what()); }
  DrawResult result() const { return result_; }

 private:
  DrawResult result_;
};

SO3 any_rotation(Draws& d) {
  return SO3::rot_z(d.between(-kPi, kPi)) * SO3::rot_y(d.between(-kPi, kPi)) *
         SO3::rot_x(d.between(-kPi, kPi));
}

SE3 placed(Draws& d, double reach) {
  return SE3::planar(d.between(-1, reach), d.between(-reach, reach), d.between(-kPi, kPi));
}

void add_thing(Draws& d, int number, sim::Scene& scene) {
  const std::string name = "thing." + std::to_string(number);
  const double reach = d.log_between(1, 8);
  const SE3 T = placed(d, reach);
  const Eigen::Vector3d size(d.log_between(0.01, 3), d.log_between(0.01, 3),
                             d.log_between(0.005, 3));
  switch (d.below(6)) {
    case 0:
      scene.add_box(name, T, size);
      return;
    case 1:
      scene.add_box(name, T * SE3(any_rotation(d), {0, 0, d.between(-1, 2)}), size);
      return;
    case 2:
      scene.add_ramp(name, T, size.x(), size.y(), size.z());
      return;
    case 3:  // stairs, up or down
      for (int k = 0; k < 1 + d.below(6); ++k) {
        const double rise = size.z() * (k + 1);
        scene.add_box(name + "." + std::to_string(k),
                      T * SE3(SO3(), {0.3 * k, 0, d.chance(0.5) ? 0 : -rise - 0.01}),
                      {0.3, 1, std::max(0.01, rise)});
      }
      return;
    case 4: {
      const Eigen::Vector2d from = T.translation().head<2>(), way(size.x() + 0.1, d.between(-3, 3));
      scene.add_wall(name, from, from + way, d.between(-0.5, 0.5), d.between(0.6, 3));
      return;
    }
    default:
      scene.add_cylinder({name, T.translation(), any_rotation(d) * Eigen::Vector3d::UnitZ(),
                          0.2 * size.x() + 0.005, size.z() + 0.05});
  }
}

sim::Scene world(Draws& d) {
  sim::Scene scene;
  if (!d.chance(0.1)) {
    std::vector<sim::Rect> holes;
    double x = d.between(0.2, 2);
    for (int k = d.below(3); k > 0; --k, x += d.between(0.2, 1)) {
      const double y = d.between(-2, 1), length = d.log_between(0.02, 2);
      holes.push_back({x, y, x + length, y + d.log_between(0.02, 3)});
      x += length;
    }
    const double size = d.log_between(2, 60);
    scene.add_ground("floor", PlaneLabel::kFloor, {-size, -size, x + size, size}, 0, holes);
    for (std::size_t k = 0; k < holes.size(); ++k)
      scene.add_hole_walls("hole." + std::to_string(k), holes[k], 0, d.log_between(0.02, 3));
    if (d.chance(0.3)) scene.add_ground("below", PlaneLabel::kFloor, {-9, -9, 30, 9}, -1);
  }
  for (int k = d.below(8); k > 0; --k) add_thing(d, k, scene);
  return scene;
}

// Upright at a usual height more often than not.
SE3 mounting(Draws& d) {
  const Eigen::Vector3d at(d.between(-0.3, 0.3), d.between(-0.3, 0.3), d.log_between(0.02, 3));
  const SO3 optical = SO3::rot_y(0.5 * kPi) * SO3::rot_z(-0.5 * kPi);
  if (d.chance(0.2)) return {any_rotation(d), d.chance(0.3) ? Eigen::Vector3d(-at) : at};
  const SO3 turned = SO3::rot_z(d.between(-0.3, 0.3)) * SO3::rot_y(d.between(-0.3, 1.5)) *
                     SO3::rot_x(d.chance(0.2) ? d.between(-kPi, kPi) : d.between(-0.1, 0.1));
  return {turned * optical, at};
}

DepthCamera any_camera(Draws& d) {
  constexpr int kSizes[][2] = {{64, 48}, {80, 60}, {160, 120}, {96, 24}, {17, 33}, {2, 2}, {8, 90}};
  const auto& size = kSizes[d.below(7)];
  DepthCamera depth;
  CameraModel& c = depth.camera;
  c.width = size[0];
  c.height = size[1];
  c.fx = c.width * d.log_between(0.3, 10);
  c.fy = d.chance(0.7) ? c.fx : c.fx * d.log_between(0.3, 3);
  c.cx = d.chance(0.7) ? 0.5 * c.width - 0.5 : c.width * d.between(-1, 2);
  c.cy = d.chance(0.7) ? 0.5 * c.height - 0.5 : c.height * d.between(-1, 2);
  c.T_body_camera = mounting(d);
  depth.depth_scale = d.chance(0.8) ? 5000 : d.log_between(1, 1e6);
  const int kind = d.below(3);
  if (kind == 0) depth.noise = DepthNoise::kinect(c.fx);
  if (kind == 1) depth.noise = DepthNoise::ideal(c.fx);
  if (kind == 2)
    depth.noise = DepthNoise::stereo(c.fx, d.log_between(0.01, 1), d.log_between(0.01, 2));
  return depth;
}

// What the robot believes of its camera.
DepthCamera accepted(Draws& d, DepthCamera camera) {
  if (d.chance(0.5)) return camera;
  CameraModel& c = camera.camera;
  const double focal = d.log_between(0.5, 2);
  if (d.chance(0.4)) c.fx *= focal, c.fy *= focal;
  if (d.chance(0.3)) camera.depth_scale *= d.log_between(0.1, 10);
  if (d.chance(0.3)) c.cx = d.between(0, c.width);
  if (d.chance(0.4)) c.T_body_camera = mounting(d);
  if (d.chance(0.05)) c.cx = kNan;
  if (d.chance(0.05)) c.fx = d.chance(0.5) ? 6.9e-310 : 1e300;
  return camera;
}

void spoil(Draws& d, std::vector<std::uint16_t>& raw) {
  if (d.chance(0.6) || raw.empty()) return;
  const int kind = d.below(4);
  const double share = d.log_between(0.001, 1);
  const auto code = static_cast<std::uint16_t>(d.chance(0.5) ? 65535 : d.below(65536));
  for (std::uint16_t& pixel : raw) {
    if (kind == 0 && d.chance(share)) pixel = static_cast<std::uint16_t>(d.below(65536));
    if (kind == 1 && (pixel == 0 || d.chance(share))) pixel = code;
    if (kind == 2 && d.chance(share)) pixel = 0;
    if (kind == 3) pixel = static_cast<std::uint16_t>(pixel / 16 * 16);
  }
}

SE3 small_motion(Draws& d) {
  if (d.chance(0.1))
    return {any_rotation(d), {d.between(-9, 9), d.between(-9, 9), d.between(-3, 3)}};
  return {SO3::rot_z(d.between(-0.2, 0.2)) * SO3::rot_y(d.between(-0.02, 0.02)),
          {d.between(-0.05, 0.2), d.between(-0.03, 0.03), d.between(-0.01, 0.01)}};
}

Timestamp next_stamp(Draws& d, Timestamp stamp) {
  const double step = d.chance(0.8) ? 0.1 : d.chance(0.5) ? d.log_between(1e-9, 1e5) : -d.unit();
  return Timestamp::from_seconds(std::max(0.0, stamp.seconds() + step));
}

std::optional<MotionGuess> guess(Draws& d, const SE3& moved) {
  if (d.chance(0.5)) return std::nullopt;
  MotionGuess wheels{d.chance(0.8) ? moved : small_motion(d), Matrix6d::Identity()};
  wheels.covariance *= d.log_between(1e-10, 1e4);
  return wheels;
}

void check_floor(const FloorResult& floor, Judge& judge) {
  judge.demand(floor.T_body_camera.matrix().allFinite(), "the camera's pose is a number");
  for (const ExtractedPlane& plane : floor.planes) {
    judge.demand(std::abs(plane.plane_body.normal().norm() - 1) < 1e-6, "normals have length 1");
    judge.demand(std::isfinite(plane.plane_body.rho()), "planes' distances are numbers");
  }
}

void check_scan(const ObstacleScan& scan, Judge& judge) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.cause[i] == BeamCause::kNone) continue;
    const double range = static_cast<double>(scan.range[i]);
    judge.demand(range >= 0 && range <= scan.range_max + 1e-3, "ranges lie within the scan's");
    judge.demand(scan.sigma[i] >= 0 && std::isfinite(scan.sigma[i]), "sigmas are numbers");
  }
  for (const EdgePoint& edge : edge_points(scan))
    judge.demand(edge.position_map.allFinite(), "edges are numbers");
  judge.demand(scan.to_laser_scan().size() == scan.size(), "one range a beam");
}

void run_images(Draws& d, Judge& judge) {
  const sim::Scene scene = world(d);
  const sim::Caster caster(scene);
  const DepthCamera camera = any_camera(d), observed = accepted(d, camera);
  sim::DepthEffects effects = d.chance(0.3) ? sim::DepthEffects::none() : sim::DepthEffects();
  effects.dropout = d.chance(0.3) ? d.unit() : 0;
  const sim::DepthRenderer renderer(caster, camera, effects, d.bits());
  ScanOptions document;
  document.method = NegativeMethod::kDocument;
  FloorFrontend floor_frontend;
  ObstacleScanner scanner(d.chance(0.1) ? document : ScanOptions());
  DepthOdometry odometry;
  SE3 T_map_body = placed(d, 2);
  if (d.chance(0.1)) T_map_body = T_map_body * SE3(any_rotation(d), {0, 0, d.between(-2, 2)});
  Timestamp stamp = Timestamp::from_seconds(1000);
  SE3 moved;
  for (int k = 1 + d.below(3); k > 0; --k) {
    DepthFrame frame = renderer.render(T_map_body * camera.camera.T_body_camera, stamp,
                                       static_cast<std::uint64_t>(k));
    frame.camera = observed;
    spoil(d, frame.raw);
    const auto wheels = guess(d, moved);
    const FloorResult floor = judge.step([&] { return floor_frontend.process(frame); });
    check_floor(floor, judge);
    const DisparityImage& disparities = floor_frontend.disparities();
    check_scan(judge.step([&] { return scanner.process(frame, floor, disparities); }), judge);
    const DepthMotion motion = judge.step([&] { return odometry.process(frame, wheels); });
    judge.demand(motion.T_prev_curr_body.matrix().allFinite() && motion.covariance.allFinite(),
                 "motions of images are numbers");
    judge.step([&] { return depth_look(frame); });
    moved = small_motion(d);
    T_map_body = T_map_body * moved;
    stamp = next_stamp(d, stamp);
  }
}

sim::LidarGeometry any_geometry(Draws& d) {
  sim::LidarGeometry g;
  g.beams = 1 + d.below(360);
  g.angle_min = d.chance(0.8) ? d.between(-kPi, 0) : d.between(-20, 20);
  g.angle_increment = d.chance(0.8) ? d.between(0.2, 2) * kPi / g.beams : d.between(-0.2, 0.2);
  g.range_max = d.log_between(1, 100);
  return g;
}

void spoil(Draws& d, LaserScan& scan) {
  if (d.chance(0.5)) return;
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const float codes[] = {0,  kInf,  -kInf,  static_cast<float>(kNan),
                         -3, 1e30F, 1e-30F, static_cast<float>(scan.range_max)};
  const double share = d.log_between(0.001, 1);
  const float code = codes[d.below(8)];
  for (float& range : scan.ranges) {
    if (d.chance(share)) range = d.chance(0.5) ? code : static_cast<float>(d.log_between(0.01, 90));
  }
  if (d.chance(0.1)) scan.angle_increment = d.chance(0.5) ? kNan : 0;
  if (d.chance(0.1)) scan.angle_min = d.chance(0.5) ? 1e9 : kNan;
  if (d.chance(0.1)) scan.range_max = d.chance(0.5) ? 0 : 1e30;
  if (d.chance(0.1)) scan.lidar.noise.range_sigma = d.log_between(1e-9, 100);
  if (d.chance(0.1)) scan.ranges.resize(static_cast<std::size_t>(d.below(4)));
  if (d.chance(0.1)) scan.time_increment = d.between(-1, 1);
}

void run_scans(Draws& d, Judge& judge) {
  const sim::Scene scene = world(d);
  const sim::Caster caster(scene);
  LidarModel model;
  model.noise.range_sigma = d.log_between(1e-4, 0.2);
  model.T_body_lidar = SE3::planar(d.between(-1, 1), d.between(-1, 1), d.between(-kPi, kPi)) *
                       SE3(SO3(), {0, 0, d.log_between(0.02, 2)});
  if (d.chance(0.2))
    model.T_body_lidar = model.T_body_lidar * SE3(any_rotation(d), Eigen::Vector3d::Zero());
  const sim::LidarSimulator simulator(caster, model, any_geometry(d), {}, d.bits());
  SegmentFrontend segments;
  ScanOdometry odometry;
  SE3 T_map_body = placed(d, 2);
  Timestamp stamp = Timestamp::from_seconds(1000);
  SE3 moved;
  for (int k = 2 + d.below(4); k > 0; --k) {
    LaserScan scan =
        simulator.render(T_map_body * model.T_body_lidar, stamp, static_cast<std::uint64_t>(k));
    spoil(d, scan);
    const auto wheels = guess(d, moved);
    const ScanMotion motion =
        judge.step([&] { return odometry.process(scan, wheels, d.chance(0.1)); });
    judge.demand(motion.T_prev_curr_body.matrix().allFinite() && motion.covariance.allFinite(),
                 "motions of scans are numbers");
    const Observations seen =
        judge.step([&] { return segments.process(scan, motion.T_prev_curr_body); });
    for (const Eigen::Vector3d& p : seen.obstacle_points_body)
      judge.demand(p.allFinite(), "points are numbers");
    moved = small_motion(d);
    T_map_body = T_map_body * moved;
    stamp = next_stamp(d, stamp);
  }
}

template <class Run>
DrawResult judged(Draws& draws, const Run& run) {
  Judge judge;
  try {
    run(draws, judge);
  } catch (const std::exception& error) {
    judge.failed(error);
  }
  return judge.result();
}

}  // namespace

Draws::Draws(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
  for (const std::uint8_t byte : bytes) state_ = (state_ ^ byte) * 0x100000001b3ULL + 1;
}

// [Steele2014], as sim/random.cpp has it.
std::uint64_t Draws::bits() {
  if (bytes_.size() >= 2) {
    const std::uint64_t two = bytes_[0] | std::uint64_t{bytes_[1]} << 8U;
    bytes_ = bytes_.subspan(2);
    return two << 48U;
  }
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31U);
}

double Draws::unit() { return static_cast<double>(bits() >> 11U) * 0x1p-53; }

double Draws::log_between(double low, double high) { return low * std::pow(high / low, unit()); }

int Draws::below(int n) { return static_cast<int>(unit() * n); }

DrawResult draw_images(Draws& draws) { return judged(draws, run_images); }

DrawResult draw_scans(Draws& draws) { return judged(draws, run_scans); }

}  // namespace lamina
