// Rims at the corners of openings, behind posts, and where single lines lose the floor.
#include <gmock/gmock.h>

#include <random>

#include <lamina/frontend/obstacles/floor_walk.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>

#include "frontend/obstacles/depth_scene.hpp"

namespace lamina {
namespace {

constexpr double kFrom = 1.5, kTo = 3, kHalf = 0.45;  // m, the opening of a stairwell

/// A camera 0.3 m above a floor with that opening, side walls and all; noise in disparity.
DepthFrame stairwell(std::uint64_t seed) {
  DepthFrame f = empty_frame(0, 0.3);
  draw(f, [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) -> double {
    const double floor = level(o, d, 0);
    const Eigen::Vector3d p = o + d * floor;
    if (floor <= 0) return (6 - o.x()) / d.x();
    if (p.x() < kFrom || p.x() > kTo || std::abs(p.y()) > kHalf) return floor;
    const double side = ((d.y() > 0 ? kHalf : -kHalf) - o.y()) / (d.y() == 0 ? 1e-9 : d.y());
    return std::min({side, (kTo - o.x()) / d.x(), level(o, d, -2)});
  });
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, f.camera.noise.disparity_sigma);
  const double fb = f.camera.noise.focal_baseline;
  for (auto& raw : f.raw) {
    if (raw == 0) continue;
    const double disparity = fb / (raw / f.camera.depth_scale) + noise(random);
    raw = static_cast<std::uint16_t>(std::lround(fb / disparity * f.camera.depth_scale));
  }
  return f;
}

TEST(RimGrowth, NoBeamPassesTheCornerOfAnOpening) {
  int beams = 0, certified = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const DepthFrame f = stairwell(seed);
    FloorFrontend frontend;
    ObstacleScanner scanner;
    const ObstacleScan scan = scanner.process(f, frontend.process(f));
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const double angle = scan.angle(i), edge = kFrom / std::cos(angle);
      const double y = edge * std::sin(angle);
      if (std::abs(y) < kHalf) {
        ++beams;
        EXPECT_LT(static_cast<double>(scan.range[i]), edge + 0.05) << "seed " << seed << " y " << y;
      }
      // A hand's breadth beside the opening floor is floor again.
      const bool beside = std::abs(y) > kHalf + 0.15 && std::abs(y) < kHalf + 0.3;
      if (beside) certified += static_cast<double>(scan.floor_range[i]) > edge + 0.05;
    }
  }
  EXPECT_GT(beams, 500);
  EXPECT_GT(certified, 200);
}

// Loses the returns of floor beyond a range (m), each with that chance.
void lose_floor(double beyond, double chance, std::uint64_t seed, DepthFrame& f) {
  std::mt19937_64 random(seed);
  std::bernoulli_distribution lost(chance);
  const double height = f.camera.camera.T_body_camera.translation().z();
  for (int v = 120; v < f.height(); ++v) {
    const double depth = height * f.camera.camera.fy / (v - f.camera.camera.cy);
    for (int u = 0; u < f.width(); ++u) {
      auto& raw = f.raw[static_cast<std::size_t>(v * f.width() + u)];
      const bool floor = raw > 0 && raw / f.camera.depth_scale < depth + 0.1;
      if (floor && depth > beyond && lost(random)) raw = 0;
    }
  }
}

// A gap is a pit's corner, perhaps, where floor was seen without holes up to it.
TEST(RimGrowth, GapsOfAFloorThatFadesAreNoCorners) {
  for (const bool fades : {false, true}) {
    DepthFrame f = empty_frame(0, 0.3);
    draw(f, [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) { return level(o, d, 0); });
    lose_floor(1.2, fades ? 0.5 : 0, 1, f);
    const int row = 120 + 58;  // 1.33 m away, 2.3 cm of floor
    std::fill_n(&f.raw[static_cast<std::size_t>(row * f.width())], f.width(), std::uint16_t{0});
    FloorFrontend frontend;
    const FloorResult floor = frontend.process(f);
    const ScanView view(f, frontend.disparities(), floor.T_body_camera);
    WalkPlanes planes = walk_planes(floor, view, {});
    int gaps = 0, corners = 0;
    for (int j = 0; j < 40; ++j) {
      const WalkEnd end = walk(view, view.line(-0.2 + 0.01 * j), floor.pixel_labels, planes, {});
      for (int k = 0; k < end.bridges; ++k) {
        const auto range = static_cast<double>(end.bridged[static_cast<std::size_t>(k)]);
        ++(range < 1.36 ? corners : gaps);
      }
    }
    if (!fades) {
      EXPECT_GT(corners, 30);
    }
    EXPECT_LT(gaps, 10);  // 94 as long as all counted
  }
}

// Floor is lost from 1.9 m on, the edge is at 3 m: no rim may be known to 0.1 m (two sigma).
TEST(RimGrowth, ARimBehindUnseenGroundIsAsUnsureAsThatIsLong) {
  DepthFrame f = empty_frame(0, 0.3);
  draw(f, [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) -> double {
    const double floor = level(o, d, 0);
    return floor > 0 && (o + d * floor).x() < 3 ? floor : (6 - o.x()) / d.x();
  });
  lose_floor(1.2, 0.6, 1, f);
  lose_floor(1.9, 1, 1, f);
  FloorFrontend frontend;
  ObstacleScanner scanner;
  const ObstacleScan scan = scanner.process(f, frontend.process(f));
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!is_negative(scan.cause[i])) continue;
    EXPECT_GT(scan.sigma[i], 0.05F) << "a rim at " << scan.range[i] << " m";
  }
}

struct Lines {
  DepthFrame frame = empty_frame();
  DisparityImage image;
  std::vector<WalkLine> lines;
  WalkPlanes planes;

  Lines() {
    fill_disparity(frame, image);
    WalkPlane floor;
    floor.disparity = {0, 0.2F, 20};
    floor.camera_height = 0.8F;
    planes.planes.push_back(floor);
  }
  ScanView view() const { return ScanView(frame, image, frame.camera.camera.T_body_camera); }
};

WalkEnd end_of(BeamCause cause, double range) {
  WalkEnd e;
  e.cause = cause;
  e.range = range;
  e.footprint = 0.02;
  e.sample = 50;
  return e;
}

TEST(RimGrowth, LinesThatLoseTheFloorBetweenTwoEndsOfARimEndAtIt) {
  Lines all;
  const ScanView view = all.view();
  for (const double other : {2.0, 2.5}) {  // the rim goes on in line, or elsewhere
    std::vector<WalkEnd> ends;
    all.lines.clear();
    for (int j = 0; j < 41; ++j) {
      all.lines.push_back(view.line(-0.06 + 0.003 * j));
      ends.push_back(end_of(BeamCause::kHole, j < 20 ? 2.0 : other));
    }
    ends[19] = ends[20] = end_of(BeamCause::kEdgeOfKnowledge, 1.7);
    grow_rims(view, all.lines, all.planes, ends);
    const BeamCause expected = other < 2.1 ? BeamCause::kHole : BeamCause::kEdgeOfKnowledge;
    EXPECT_EQ(ends[19].cause, expected);
    EXPECT_EQ(ends[20].cause, expected);
    EXPECT_NEAR(ends[20].range, other < 2.1 ? 2.0 : 1.7, 1e-9);
  }
}

TEST(RimGrowth, SpecksAreNoHolesAndSpecksBesideARimBarWhatIsBehind) {
  Lines all;
  const ScanView view = all.view();
  std::vector<WalkEnd> ends;
  for (int j = 0; j < 60; ++j) {
    all.lines.push_back(view.line(-0.09 + 0.003 * j));
    ends.push_back(end_of(BeamCause::kObstacle, 1.5));
  }
  for (const int j : {10, 11, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54}) {
    ends[static_cast<std::size_t>(j)] = end_of(BeamCause::kHole, 2);
  }
  ends[40] = end_of(BeamCause::kHole, 2);
  grow_rims(view, all.lines, all.planes, ends);
  EXPECT_EQ(ends[10].cause, BeamCause::kEdgeOfKnowledge);
  EXPECT_FALSE(ends[10].barred);
  EXPECT_EQ(ends[40].cause, BeamCause::kEdgeOfKnowledge);
  EXPECT_TRUE(ends[40].barred);
  EXPECT_EQ(ends[50].cause, BeamCause::kHole);
}

}  // namespace
}  // namespace lamina
