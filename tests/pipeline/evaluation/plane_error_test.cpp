// Matching of planes with truth.
#include <gtest/gtest.h>

#include <lamina/pipeline/evaluation/plane_error.hpp>

namespace lamina {
namespace {

// A wall at x = `x` seen from the origin, y in [y0, y1], z in [0, 2].
std::vector<Eigen::Vector3d> wall_outline(double x, double y0, double y1) {
  return {{x, y0, 0}, {x, y1, 0}, {x, y1, 2}, {x, y0, 2}};
}

ReferencePlane true_wall(std::int64_t id, double x, double y0, double y1) {
  return {id, Plane({-1, 0, 0}, -x), wall_outline(x, y0, y1), 1000};
}

MapPlane map_wall(std::int64_t id, double x, double y0, double y1, double yaw = 0) {
  MapPlane plane;
  plane.id = id;
  plane.centroid_map = {x, 0.5 * (y0 + y1), 1};
  const Eigen::Vector3d normal = SO3::rot_z(yaw) * Eigen::Vector3d(-1, 0, 0);
  plane.plane_map = Plane(normal, normal.dot(plane.centroid_map));
  plane.outlines_map = {wall_outline(x, y0, y1)};
  plane.area = 2 * (y1 - y0);
  plane.covariance = Eigen::Matrix3d::Identity() * 1e-4;
  return plane;
}

TEST(PlaneErrors, MeasuresDistanceAndAngleAtTheCentroid) {
  const auto errors =
      plane_errors({map_wall(1, 5.03, -1, 1, 0.01)}, {true_wall(9, 5, -1, 1)}, SE3());
  ASSERT_EQ(errors.matches.size(), 1u);
  EXPECT_NEAR(errors.rho_mean_m, 0.03, 1e-9);
  EXPECT_NEAR(errors.angle_mean_deg, 0.01 * 180 / M_PI, 1e-9);
  EXPECT_TRUE(errors.missed.empty() && errors.split.empty() && errors.spurious.empty());
}

// Heading and lean are known differently well: a wall that scans alone saw is no better told in
// heading for not being told in lean.
TEST(PlaneErrors, SquaresAreTakenByTheWholeCovariance) {
  MapPlane wall = map_wall(1, 5, -1, 1, 0.01);
  const Matrix32d B = wall.plane_map.tangent_basis();
  const Eigen::Vector3d lean = wall.plane_map.normal().cross(Eigen::Vector3d::UnitZ());
  const Eigen::Vector2d level = (B.transpose() * lean).normalized();
  const Eigen::Vector2d upright(-level.y(), level.x());
  wall.covariance.setIdentity();
  wall.covariance.topLeftCorner<2, 2>() =
      0.01 * 0.01 * level * level.transpose() + upright * upright.transpose();
  const auto errors = plane_errors({wall}, {true_wall(9, 5, -1, 1)}, SE3());
  ASSERT_EQ(errors.matches.size(), 1u);
  EXPECT_NEAR(errors.matches[0].normalized_squared, 1, 1e-3);
}

// Covariances are against the first pose, wherever the path as a whole is laid.
TEST(PlaneErrors, SquaresAreTakenFromTheFirstPose) {
  const auto errors = plane_errors({map_wall(1, 5.02, -1, 1)}, {true_wall(9, 5, -1, 1)},
                                   SE3(SO3(), {-0.02, 0, 0}), {}, SE3());
  ASSERT_EQ(errors.matches.size(), 1u);
  EXPECT_NEAR(errors.matches[0].rho_error_m, 0, 1e-12);
  EXPECT_NEAR(errors.matches[0].normalized_squared, 4, 1e-9);
}

TEST(PlaneErrors, TellsMissedSplitMergedAndSpurious) {
  const std::vector<ReferencePlane> truth{true_wall(1, 5, -4, -2), true_wall(2, 5, 2, 4),
                                          true_wall(3, 9, -1, 1), true_wall(4, 20, -1, 1)};
  const std::vector<MapPlane> map{map_wall(10, 5, -4, 4), map_wall(11, 9, -1, 0),
                                  map_wall(12, 9, 0, 1), map_wall(13, 14, -1, 1)};
  PlaneMatchOptions options;
  options.min_overlap = 0.2;
  const auto errors = plane_errors(map, truth, SE3(), options);
  EXPECT_EQ(errors.merged, std::vector<std::int64_t>{10});
  EXPECT_EQ(errors.split, std::vector<std::int64_t>{3});
  EXPECT_EQ(errors.spurious, std::vector<std::int64_t>{13});
  EXPECT_EQ(errors.missed, std::vector<std::int64_t>{4});
}

TEST(PlaneErrors, AWallGoesOnBeyondItsDoors) {
  const std::vector<ReferencePlane> truth{true_wall(1, 5, -4, -1), true_wall(2, 5, 0, 3)};
  const auto errors = plane_errors({map_wall(10, 5, -4, 3)}, truth, SE3());
  EXPECT_TRUE(errors.merged.empty() && errors.missed.empty() && errors.split.empty());
  EXPECT_EQ(errors.matches.size(), 2u);
}

// Of a wall 2 m high and 1 m wide a scanner sees a stroke along a longer one with a door.
TEST(PlaneErrors, AShortStretchBesideADoorIsFoundByItsLengthInPlan) {
  const std::vector<ReferencePlane> truth{true_wall(1, 5, -8, -1), true_wall(2, 5, 0, 1)};
  MapPlane wall = map_wall(10, 5, -8, -1);
  const auto stroke = [](double y0, double y1) {
    return std::vector<Eigen::Vector3d>{{5, y0, 0.3}, {5, y1, 0.3}, {5, y1, 0.4}, {5, y0, 0.4}};
  };
  wall.outlines_map.push_back(stroke(0, 1));
  EXPECT_TRUE(plane_errors({wall}, truth, SE3()).missed.empty());
  wall.outlines_map.back() = stroke(0, 0.1);
  EXPECT_EQ(plane_errors({wall}, truth, SE3(), {.border = 0.05}).missed,
            std::vector<std::int64_t>{2});
}

TEST(PlaneErrors, APillarBeforeAWallIsNotTheWall) {
  const std::vector<ReferencePlane> truth{true_wall(1, 5, -4, 4), true_wall(2, 4.8, -0.3, 0.3)};
  const std::vector<MapPlane> map{map_wall(10, 5, -4, 4), map_wall(11, 4.79, -0.3, 0.3)};
  const auto errors = plane_errors(map, truth, SE3());
  EXPECT_TRUE(errors.merged.empty() && errors.missed.empty() && errors.split.empty());
  ASSERT_EQ(errors.matches.size(), 2u);
  EXPECT_EQ(errors.matches[0].map_id, 10);
  EXPECT_EQ(errors.matches[1].map_id, 11);
}

TEST(PlaneErrors, MovesTheMapFirst) {
  const SE3 T_reference_map(SO3::rot_z(0.3), {1, 2, 0});
  auto truth = true_wall(1, 5, -1, 1);
  truth.plane = T_reference_map * truth.plane;
  for (auto& p : truth.outline) p = T_reference_map * p;
  const auto errors = plane_errors({map_wall(1, 5, -1, 1)}, {truth}, T_reference_map);
  ASSERT_EQ(errors.matches.size(), 1u);
  EXPECT_LT(errors.rho_max_m, 1e-12);
}

TEST(NearPairs, AreWallsThatLookDrawnTwice) {
  const std::vector<MapPlane> map{map_wall(1, 5, -4, 4),       map_wall(2, 5.2, -2, 0),
                                  map_wall(3, 5.5, -4, 4),     map_wall(4, 5.1, 6, 8),
                                  map_wall(5, 5.1, 1, 3, 0.1), map_wall(6, -5, -4, 4)};
  // Too far, beside it, turned, and elsewhere are none.
  const std::vector<std::pair<std::int64_t, std::int64_t>> expected{{1, 2}, {2, 3}};
  EXPECT_EQ(near_pairs(map, {.max_distance = 0.31}), expected);
  EXPECT_EQ(near_pairs(map, {.max_distance = 0.1}).size(), 0u);
}

}  // namespace
}  // namespace lamina
