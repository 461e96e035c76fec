// The whole chain on literal scenes: planes, floor, surface, and what must not crash it.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/floor_memory.hpp>
#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/models/error.hpp>
#include <lamina/models/polygon.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

using namespace testing;
constexpr double kDegree = M_PI / 180;
constexpr double kSigma = 0.05;  // px

FloorResult process(const std::vector<Piece>& scene, const DepthCamera& camera = test_camera(),
                    const FloorOptions& options = {}) {
  FloorFrontend frontend(options);
  return frontend.process(draw(scene, camera, kSigma));
}

TEST(FloorFrontend, FindsAFloorAndTheWallBehindIt) {
  const FloorResult r = process({floor_piece(), wall_piece(3)});
  EXPECT_EQ(r.status, FloorStatus::kFound);
  ASSERT_EQ(r.planes.size(), 2u);
  ASSERT_EQ(r.dominant, 0);
  EXPECT_EQ(r.planes[0].kind, PlaneKind::kDominantFloor);
  EXPECT_EQ(r.planes[1].kind, PlaneKind::kObstacle);
  EXPECT_NEAR(r.planes[1].slope / kDegree, 90, 0.2);
  EXPECT_NEAR(r.planes[1].plane_body.rho(), -3, 0.01);
  EXPECT_NEAR(r.mounting.height, 0.8, 0.002);
  EXPECT_NEAR(r.planes[0].area, 3 * 2.5, 3);
  // Almost every pixel belongs to one of the two.
  const auto labelled = std::count_if(r.pixel_labels.begin(), r.pixel_labels.end(),
                                      [](std::uint8_t k) { return k > 0; });
  EXPECT_GT(labelled, 0.97 * 640 * 480);
}

// Along a wall a pixel spans decimetres there: blocks at its end reached metres over the opening.
TEST(FloorFrontend, AWallSeenAtAGrazingAngleDoesNotReachOverWhatLiesBeyondIt) {
  DepthCamera camera = test_camera(0.2);
  camera.camera = {424, 240, 320, 320, 211.5, 119.5, {}, camera.camera.T_body_camera};
  camera.noise = DepthNoise::stereo(320, 0.05, 0.1);
  const Piece wall{Plane({0, -1, 0}, -1), [](const Eigen::Vector3d& p) { return p.x() < 8; }};
  FloorFrontend frontend;
  const FloorResult r = frontend.process(draw({floor_piece(), wall, wall_piece(10)}, camera, 0.1));
  double farthest = 0;
  for (const ExtractedPlane& plane : r.planes) {
    if (plane.plane_body.normal().y() > -0.9) continue;
    for (const Eigen::Vector3d& p : plane.outline_camera)
      farthest = std::max(farthest, (camera.camera.T_body_camera * p).x());
  }
  EXPECT_GT(farthest, 4.5);
  EXPECT_LT(farthest, 8);
}

// A wall with a door, seen obliquely: it ends where it ends, though blocks at its end hold both.
TEST(FloorFrontend, AWallEndsWhereItEndsAndNotABlockFurther) {
  for (const double end : {2.5, 2.53, 2.56, 2.6}) {
    DepthCamera camera = test_camera(0.2, 1.2);
    camera.camera = {320, 240, 289, 289, 159.5, 119.5, {}, camera.camera.T_body_camera};
    camera.noise = DepthNoise::kinect(289);
    const Piece wall{Plane({-M_SQRT1_2, -M_SQRT1_2, 0}, -2.5),
                     [=](const Eigen::Vector3d& p) { return p.x() < end; }};
    FloorFrontend frontend;
    const FloorResult r =
        frontend.process(draw({floor_piece(), wall, wall_piece(6)}, camera, kSigma));
    double farthest = 0;
    for (const ExtractedPlane& plane : r.planes) {
      if (plane.plane_body.normal().y() > -0.5) continue;
      for (const Eigen::Vector3d& p : plane.outline_camera)
        farthest = std::max(farthest, (camera.camera.T_body_camera * p).x());
    }
    EXPECT_GT(farthest, end - 0.08) << end;
    EXPECT_LT(farthest, end + 0.02) << end;
  }
}

// Coarse stereo, whose matcher errs by windows at once: ranges scatter by 0.4 m there, and the
// wall's foot passes for floor behind it.
TEST(FloorFrontend, AFloorByCoarseStereoDoesNotReachBehindTheWallItMeets) {
  constexpr double kWindow = 10, kSigmaPx = 0.2;
  DepthCamera camera = test_camera(0.3, 1);
  camera.camera = {320, 240, 200, 200, 159.5, 119.5, {}, camera.camera.T_body_camera};
  camera.noise = DepthNoise::stereo(200, 0.06, kSigmaPx);
  DepthFrame frame = draw({floor_piece(), wall_piece(5)}, camera);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, kSigmaPx);
  std::map<std::pair<int, int>, double> errors;
  for (int k = 0; k < 320 * 240; ++k) {
    auto& raw = frame.raw[static_cast<std::size_t>(k)];
    const auto at =
        std::pair(static_cast<int>(k % 320 / kWindow), static_cast<int>(k / 320 / kWindow));
    const auto [error, fresh] = errors.try_emplace(at);
    if (fresh) error->second = normal(random);
    const double fb = camera.noise.focal_baseline * camera.depth_scale;
    if (raw > 0) raw = static_cast<std::uint16_t>(fb / (fb / raw + error->second));
  }
  FloorFrontend frontend;
  const FloorResult r = frontend.process(frame);
  ASSERT_EQ(r.status, FloorStatus::kFound);
  double farthest = 0;
  for (const Eigen::Vector3d& p : r.planes[static_cast<std::size_t>(r.dominant)].outline_camera)
    farthest = std::max(farthest, (camera.camera.T_body_camera * p).x());
  EXPECT_GT(farthest, 3);
  EXPECT_LT(farthest, 5.2);
}

// A stereo camera's ranges scatter by 4 cm a patch there: what belongs to a wall stands in it.
TEST(FloorFrontend, NoiseOfRangesStrewsNoWallOverTheFloorBeforeIt) {
  DepthCamera camera = test_camera();
  camera.noise = DepthNoise::stereo(525, 0.05, 0.4);
  FloorFrontend frontend;
  const FloorResult r = frontend.process(draw({floor_piece(), wall_piece(3)}, camera, 0.4));
  ASSERT_EQ(r.status, FloorStatus::kFound);
  ASSERT_GT(r.obstacle_points_body.size(), 30u);
  for (const Eigen::Vector3d& p : r.obstacle_points_body) EXPECT_GT(p.x(), 2.9);
}

TEST(FloorFrontend, CorrectsAWrongMounting) {
  for (const double error_deg : {-5.0, -1.0, 2.0, 5.0}) {
    DepthFrame frame = draw({floor_piece(), wall_piece(4)}, test_camera(), kSigma);
    const SE3 truth = frame.camera.camera.T_body_camera;
    frame.camera.camera.T_body_camera =
        SE3(SO3::exp({error_deg * kDegree, -error_deg * kDegree, 0}) * truth.so3(),
            truth.translation() + Eigen::Vector3d(0, 0, 0.02));
    FloorFrontend frontend;
    const FloorResult r = frontend.process(frame);
    ASSERT_EQ(r.status, FloorStatus::kFound) << error_deg;
    EXPECT_TRUE(r.mounting.changed);
    const Leveling left = leveling_of(truth, *r.floor_camera);
    EXPECT_LT(std::hypot(left.roll, left.pitch), 0.05 * kDegree) << error_deg;
    EXPECT_NEAR(left.height, 0.8, 0.002) << error_deg;
  }
}

TEST(FloorFrontend, FindsTheFloorOfAnUnknownMounting) {
  DepthFrame frame = draw({floor_piece(), wall_piece(4)}, test_camera(0.25, 1.28), kSigma);
  frame.camera.camera.T_body_camera = SE3(SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), {0, 0, 0});
  FloorFrontend frontend;
  const FloorResult r = frontend.process(frame);
  ASSERT_EQ(r.status, FloorStatus::kFound) << r.reason;
  EXPECT_NEAR(r.mounting.height, 1.28, 0.005);
  EXPECT_NEAR(r.mounting.pitch, 0.25, 0.002);
  EXPECT_NEAR(r.T_body_camera.translation().z(), 1.28, 0.005);
}

TEST(FloorFrontend, KeepsAPlatformApartAndKnowsItsHeight) {
  const FloorResult r = process({floor_piece(), square_piece(2, 0, 0.5, 0.03)});
  ASSERT_EQ(r.status, FloorStatus::kFound);
  ASSERT_GE(r.planes.size(), 2u);
  EXPECT_EQ(r.planes[1].kind, PlaneKind::kSubDominant);
  EXPECT_NEAR(r.planes[1].height, 0.03, 0.002);
  const auto on = r.surface.height_at({2.0, 0.0}), beside = r.surface.height_at({2.0, 1.0});
  ASSERT_TRUE(on && beside);
  EXPECT_NEAR(*on, 0.03, 0.003);
  EXPECT_NEAR(*beside, 0.0, 0.003);
  EXPECT_FALSE(r.surface.height_at({-3.0, 0.0}));
}

// Two posts as far from each other as door frames: some plane through both there always is.
TEST(FloorFrontend, PostsAtEitherEndOfTheImageAreNotOnePlane) {
  const auto post = [](double x, double y) {
    return Piece{Plane({-1, 0, 0}, -x),
                 [y](const Eigen::Vector3d& p) { return std::abs(p.y() - y) < 0.1 && p.z() < 1; }};
  };
  const FloorResult r = process({post(2.6, 1.1), post(3.0, -1.3)}, test_camera(0));
  ASSERT_EQ(r.planes.size(), 2U);
  for (const ExtractedPlane& plane : r.planes) {
    EXPECT_GT(-plane.plane_body.normal().x(), std::cos(2 * kDegree));
  }
}

TEST(FloorFrontend, SurfaceFollowsARamp) {
  const double slope = std::tan(8 * kDegree);
  const Piece ramp{Plane(Eigen::Vector3d(-slope, 0, 1), -1.5 * slope),
                   [](const Eigen::Vector3d& p) { return p.x() > 1.5; }};
  const Piece floor{Plane(), [](const Eigen::Vector3d& p) { return p.x() <= 1.5; }};
  const FloorResult r = process({floor, ramp});
  ASSERT_EQ(r.status, FloorStatus::kFound) << r.reason;
  const auto height = r.surface.height_at({2.5, 0.0});
  ASSERT_TRUE(height);
  EXPECT_NEAR(*height, slope, 0.01);
}

// What all pixels of a side wall are off by (px), where it is seen from 2 m to `end`; 0: not found.
double shared_by_side_wall(double end) {
  const Piece side{Plane({0, -1, 0}, -0.6), [end](const Eigen::Vector3d& p) {
                     return p.x() > 2 && p.x() < end && p.z() > 0;
                   }};
  for (const ExtractedPlane& p : process({floor_piece(), side}).planes) {
    if (p.slope < 1) continue;
    const double z = p.moments_camera.mean().z();
    return p.floor.sigma_rho * test_camera().noise.focal_baseline /
           (std::abs(p.plane_camera.rho()) * z);
  }
  return 0;
}

// Sensors compare windows: where a face at a grazing angle is as narrow as they, it is off.
TEST(FloorFrontend, NarrowGrazingFacesAreKnownLess) {
  const double wide = shared_by_side_wall(6), narrow = shared_by_side_wall(2.6);
  EXPECT_GT(wide, test_camera().noise.disparity_floor);
  EXPECT_LT(wide, 0.12);
  EXPECT_GT(narrow, 2 * wide);
}

TEST(FloorFrontend, ObservationsCarryMomentsThatFitTheirPlanes) {
  const FloorResult r = process({floor_piece(), wall_piece(3)});
  const Observations o = r.to_observations();
  ASSERT_EQ(o.planes.size(), 2u);
  for (const PlaneObservation& p : o.planes) {
    const auto fit = p.moments_sensor.fit_plane(Eigen::Vector3d::Zero(), 1.0);
    ASSERT_TRUE(fit);
    EXPECT_LT(angle_between(fit->plane, p.plane_sensor), 0.05 * kDegree);
    EXPECT_NEAR(fit->plane.rho(), p.plane_sensor.rho(), 5e-4);
    EXPECT_GT(p.plane_sensor.signed_distance(Eigen::Vector3d::Zero()), 0);
    EXPECT_GT(p.floor.sigma_rho, 0);
    EXPECT_GE(p.outline_sensor.size(), 4u);
    for (const auto& corner : p.outline_sensor) {
      EXPECT_NEAR(p.plane_sensor.signed_distance(corner), 0, 1e-9);
    }
  }
  EXPECT_FALSE(o.floor_patches.empty());
  EXPECT_EQ(o.floor_patches.size(), o.surfels_body.size());
  for (const Surfel& s : o.surfels_body) {
    EXPECT_GT(s.sigma_height(), 0);
    EXPECT_LT(std::abs(s.center.z()), 0.02);
  }
}

TEST(FloorFrontend, TurningTheWorldTurnsTheResult) {
  // The same floor and wall, camera rolled: labels differ, planes do not.
  const FloorResult level = process({floor_piece(), wall_piece(3)});
  DepthCamera rolled = test_camera();
  rolled.camera.T_body_camera =
      SE3(SO3::rot_x(0.2) * rolled.camera.T_body_camera.so3(), {0.3, -0.2, 0.8});
  const FloorResult turned = process({floor_piece(), wall_piece(3)}, rolled);
  ASSERT_EQ(turned.planes.size(), level.planes.size());
  for (std::size_t k = 0; k < level.planes.size(); ++k) {
    EXPECT_LT(angle_between(level.planes[k].plane_body, turned.planes[k].plane_body),
              0.1 * kDegree);
  }
}

TEST(FloorFrontend, IsDeterministic) {
  const DepthFrame frame =
      draw({floor_piece(), wall_piece(3), square_piece(2, 0.3, 0.3, 0.1)}, test_camera(), kSigma);
  FloorFrontend a, b;
  const FloorResult first = a.process(frame), second = b.process(frame);
  a.reset();
  const FloorResult third = a.process(frame);
  EXPECT_EQ(first.pixel_labels, second.pixel_labels);
  EXPECT_EQ(first.pixel_labels, third.pixel_labels);
  ASSERT_EQ(first.planes.size(), second.planes.size());
  for (std::size_t k = 0; k < first.planes.size(); ++k) {
    EXPECT_EQ(first.planes[k].disparity, second.planes[k].disparity);
  }
}

TEST(FloorFrontend, SaysWhyThereIsNoFloor) {
  DepthCamera level = test_camera(0.0, 0.8);
  EXPECT_EQ(process({wall_piece(1.2)}, level).status, FloorStatus::kNoFloor);
  EXPECT_FALSE(process({wall_piece(1.2)}, level).reason.empty());
  std::vector<Piece> stairs;
  for (int i = 0; i < 4; ++i) {
    const double x = 1.0 + 0.3 * i, z = 0.17 * (i + 1);
    stairs.push_back({Plane({0, 0, 1}, z),
                      [=](const Eigen::Vector3d& p) { return p.x() > x && p.x() < x + 0.3; }});
    stairs.push_back({Plane({-1, 0, 0}, -x),
                      [=](const Eigen::Vector3d& p) { return p.z() > z - 0.17 && p.z() < z; }});
  }
  const FloorResult r = process(stairs, test_camera(0.3));
  EXPECT_NE(r.status, FloorStatus::kFound);
  EXPECT_LT(r.dominant, 0);
  EXPECT_TRUE(r.surface.empty());
}

TEST(FloorFrontend, ATimeBudgetDropsTheFarthestAndSaysWhich) {
  FloorOptions options;
  options.time_budget_ms = 1e-9;
  const FloorResult r = process({floor_piece()}, test_camera(), options);
  ASSERT_FALSE(r.skipped_sections.empty());
  EXPECT_EQ(r.skipped_sections.back().first, 3);
}

TEST(FloorFrontend, SenselessFramesGiveNoPlanes) {
  const DepthFrame good = draw({floor_piece()}, test_camera());
  std::vector<DepthFrame> frames(8, good);
  frames[0].raw.clear();
  std::fill(frames[1].raw.begin(), frames[1].raw.end(), std::uint16_t{0});
  std::fill(frames[2].raw.begin(), frames[2].raw.end(), std::uint16_t{0});
  frames[2].raw[150000] = 9000;
  std::fill(frames[3].raw.begin(), frames[3].raw.end(), std::uint16_t{65535});
  frames[4].camera.camera.width = frames[4].camera.camera.height = 1;
  frames[4].raw = {5000};
  frames[5].camera.camera.width = 0;
  frames[6].camera.camera.fx = 0;
  frames[7].camera.depth_scale = 0;
  FloorFrontend frontend;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FloorResult r = frontend.process(frames[i]);
    EXPECT_TRUE(r.planes.empty()) << i;
    EXPECT_EQ(r.status, FloorStatus::kNoData) << i;
    EXPECT_TRUE(r.low_obstacles.empty()) << i;
    EXPECT_TRUE(r.to_observations().planes.empty()) << i;
  }
  EXPECT_EQ(frontend.process(good).status, FloorStatus::kFound);
}

TEST(FloorFrontend, AMirroredFrameHasNoFloor) {
  DepthFrame frame = draw({floor_piece()}, test_camera());
  std::reverse(frame.raw.begin(), frame.raw.end());
  FloorFrontend frontend;
  const FloorResult r = frontend.process(frame);
  EXPECT_NE(r.status, FloorStatus::kFound);
  EXPECT_TRUE(r.low_obstacles.empty());
}

TEST(FloorFrontend, BadOptionsAreRefused) {
  FloorOptions options;
  options.cell_m = 0;
  EXPECT_THROW(FloorFrontend{options}, Error);
}

}  // namespace
}  // namespace lamina
