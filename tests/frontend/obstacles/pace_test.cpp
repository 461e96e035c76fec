// The fast ways of walks and positive scans against the same one pixel at a time: equal to the bit.
#include <gmock/gmock.h>

#include <random>

#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/frontend/obstacles/positive_scan.hpp>

#include "frontend/obstacles/depth_scene.hpp"

namespace lamina {
namespace {

using Ray = Eigen::Vector3d;

/// A floor with a pit, a ramp of 6 deg, a box and a wall; noise in disparity, pixels missing.
DepthFrame busy_frame(std::uint64_t seed, double pitch, double roll, double height) {
  DepthFrame f = empty_frame(pitch, height);
  f.camera.camera.width = 319;  // not a multiple of four
  f.raw.assign(319 * 240, 0);
  SE3& T = f.camera.camera.T_body_camera;
  T = SE3(SO3::rot_x(roll) * T.so3(), T.translation());
  draw(f, [](const Ray& o, const Ray& d) -> double {
    double z = (4.0 - o.x()) / d.x();
    const double floor = level(o, d, 0), top = level(o, d, 0.2), along = d.z() - 0.1 * d.x();
    const Ray p = o + d * floor, q = o + d * top;
    const bool pit = p.x() > 1.4 && p.x() < 2.2 && std::abs(p.y()) < 0.4;
    if (floor > 0 && !pit) z = std::min(z, floor);
    if (floor > 0 && pit) z = std::min({z, (2.2 - o.x()) / d.x(), level(o, d, -0.3)});
    if (top > 0 && q.x() > 1.5 && q.x() < 1.8 && q.y() > 0.6 && q.y() < 1) z = std::min(z, top);
    const double ramp = along < 0 ? (0.1 * (o.x() - 2.6) - o.z()) / along : 0;
    if (ramp > 0 && (o + d * ramp).x() > 2.6) z = std::min(z, ramp);
    return z;
  });
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 0.08);
  const double fb = f.camera.noise.focal_baseline;
  for (auto& raw : f.raw) {
    if (raw == 0 || random() % 50 == 0) {
      raw = 0;
      continue;
    }
    const double disparity = fb / (raw / f.camera.depth_scale) + noise(random);
    raw = static_cast<std::uint16_t>(std::lround(fb / disparity * f.camera.depth_scale));
  }
  return f;
}

void expect_same(const WalkEnd& a, const WalkEnd& b) {
  EXPECT_EQ(a.cause, b.cause);
  EXPECT_EQ(a.range, b.range);
  EXPECT_EQ(a.footprint, b.footprint);
  EXPECT_EQ(a.gap, b.gap);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.sample, b.sample);
  EXPECT_EQ(a.history, b.history);
  EXPECT_EQ(a.bridges, b.bridges);
  EXPECT_EQ(a.beyond, b.beyond);
}

TEST(Pace, StridesAndSinglePixelsGiveTheSame) {
  int walked = 0, negative = 0, obstacles = 0;
  for (const double height : {0.5, 0.8, 1.2}) {
    const double pitch = height < 0.6 ? 0.25 : 0.4;
    for (const double roll : {0.0, 0.05}) {
      const DepthFrame f = busy_frame(static_cast<std::uint64_t>(10 * height), pitch, roll, height);
      FloorFrontend frontend;
      const FloorResult floor = frontend.process(f);
      const ScanView view(f, frontend.disparities(), floor.T_body_camera);
      const ScanOptions options;
      WalkPlanes planes = walk_planes(floor, view, options);
      if (planes.planes.empty()) continue;  // too busy for a floor
      ++walked;
      for (double a = view.azimuth_from; a < view.azimuth_to; a += 0.004) {
        const WalkLine line = view.line(a);
        const auto end_of = [&](Pace pace) {
          return walk(view, line, floor.pixel_labels, planes, options, pace);
        };
        const WalkEnd one = end_of(Pace::kOneByOne);
        expect_same(end_of(Pace::kStrides), one);
        negative += is_negative(one.cause);
      }
      const auto scanned = [&](Pace pace) {
        ObstacleScan scan = ObstacleScan::empty(Timestamp(), -0.6, 0.004, 300, 8);
        PositiveBuffers buffers;
        positive_scan(view, floor.pixel_labels, planes, options, buffers, scan, pace);
        return scan;
      };
      const ObstacleScan fast = scanned(Pace::kStrides), slow = scanned(Pace::kOneByOne);
      EXPECT_EQ(fast.cause, slow.cause);
      for (std::size_t i = 0; i < slow.size(); ++i) {
        if (slow.cause[i] == BeamCause::kNone) continue;
        EXPECT_EQ(fast.range[i], slow.range[i]);
        EXPECT_EQ(fast.sigma[i], slow.sigma[i]);
        ++obstacles;
      }
    }
  }
  EXPECT_GE(walked, 3);
  EXPECT_GT(negative, 50);
  EXPECT_GT(obstacles, 300);
}

TEST(Pace, DisparitiesOfTheFloorFrontEndWillDo) {
  const DepthFrame f = busy_frame(3, 0.35, 0, 0.8);
  FloorFrontend frontend;
  const FloorResult floor = frontend.process(f);
  ObstacleScanner a, b;
  const ObstacleScan own = a.process(f, floor);
  const ObstacleScan shared = b.process(f, floor, frontend.disparities());
  ASSERT_GT(own.size(), 100u);
  EXPECT_EQ(own.cause, shared.cause);
  EXPECT_EQ(own.sigma, shared.sigma);
}

}  // namespace
}  // namespace lamina
