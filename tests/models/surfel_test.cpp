// Surfels, floors of them, scan segments and the planar map: frames and covariances.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include <lamina/models/error.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/plane.hpp>
#include <lamina/models/scan_segment.hpp>
#include <lamina/models/surfel_floor.hpp>

#include "support/matchers.hpp"
#include "support/random.hpp"
#include "support/statistics.hpp"

namespace lamina::test {
namespace {

Eigen::MatrixXd root_of(const Eigen::Matrix3d& covariance) {
  // Cholesky by hand for 3 x 3: enough to draw errors.
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      const double rest = covariance(i, j) - L.row(i).head(j).dot(L.row(j).head(j));
      L(i, j) = i == j ? std::sqrt(rest) : rest / L(j, j);
    }
  }
  return L;
}

Eigen::Matrix3d some_covariance() {
  Eigen::Matrix3d A;
  A << 0.02, 0, 0, 0.01, 0.03, 0, -0.001, 0.002, 0.004;
  return A * A.transpose();
}

TEST(Surfel, TransformMovesItAndItsCovariance) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    Surfel surfel;
    surfel.center = random.in_cube(3);
    surfel.normal = random.unit_vector();
    surfel.radius = 0.1;
    surfel.covariance = some_covariance();
    surfel.parent_plane = 7;
    const SE3 T_a_b = random.pose(5);
    const Surfel moved = surfel.transformed(T_a_b);
    EXPECT_THAT(moved.center, IsNear(Eigen::Vector3d(T_a_b * surfel.center), 1e-13));
    EXPECT_THAT(moved.normal, IsNear(Eigen::Vector3d(T_a_b.so3() * surfel.normal), 1e-14));
    EXPECT_EQ(moved.parent_plane, 7);
    EXPECT_EQ(moved.radius, 0.1);
    // Variance of the height of any point of the disc is the same in both frames.
    const Eigen::Vector2d in_plane(random.normal(0.1), random.normal(0.1));
    const auto variance_at = [](const Surfel& s, const Eigen::Vector3d& x) {
      // Tilting the normal by b_k lowers the plane at x by b_k.(x - center).
      Eigen::Vector3d row;
      row << -Plane::tangent_basis(s.normal).transpose() * (x - s.center), 1;
      return row.dot(s.covariance * row);
    };
    const Eigen::Vector3d x = surfel.center + Plane::tangent_basis(surfel.normal) * in_plane;
    EXPECT_NEAR(variance_at(surfel, x), variance_at(moved, T_a_b * x), 1e-14);
    EXPECT_NEAR(moved.sigma_height(), surfel.sigma_height(), 1e-15);
    EXPECT_THAT(moved.transformed(T_a_b.inverse()).covariance, IsNear(surfel.covariance, 1e-14));
  }
}

// Drawn errors of a surfel, moved as planes are moved, spread as the moved covariance says.
TEST(Surfel, MovedCovarianceIsConsistent) {
  Random setup(2);
  for (int i = 0; i < 3; ++i) {
    Surfel truth;
    truth.center = {1, 2, 0};
    truth.normal = setup.unit_vector();
    truth.covariance = some_covariance();
    const SE3 T_a_b = setup.pose(3);
    const Surfel moved_truth = truth.transformed(T_a_b);
    const Eigen::MatrixXd L = root_of(truth.covariance);
    const auto plane_of = [](const Surfel& s) { return Plane(s.normal, s.normal.dot(s.center)); };
    const auto draw = [&](Random& random) {
      const Plane about = plane_of(truth).about(truth.center);
      const Plane drawn_b = about.boxplus(L * random.normal_vector(3));
      const Plane drawn_a =
          T_a_b * Plane(drawn_b.normal(), drawn_b.rho() + drawn_b.normal().dot(truth.center));
      const Eigen::VectorXd error = drawn_a.about(moved_truth.center)
                                        .boxminus(plane_of(moved_truth).about(moved_truth.center));
      return ErrorAndCovariance{error, moved_truth.covariance};
    };
    EXPECT_TRUE(is_consistent(draw, 1000)) << i;
  }
}

TEST(SurfelFloor, CellsAndKeys) {
  SurfelFloor floor(0.1);
  const SurfelFloor::Key key = floor.key_of({-0.01, 0.25, 3});
  EXPECT_EQ(key, (SurfelFloor::Key{-1, 2, 0}));
  EXPECT_THAT(floor.center_of(key), IsNear(Eigen::Vector2d(-0.05, 0.25), 1e-15));
  EXPECT_EQ(floor.find(key), nullptr);
  floor.at_or_new(key).height = 0.5;
  ASSERT_NE(floor.find(key), nullptr);
  EXPECT_EQ(floor.find(key)->height, 0.5);
  EXPECT_THROW(floor.surfel({5, 5, 0}), std::logic_error);
  SurfelFloor::Key above = key;
  above.level = 1;
  EXPECT_EQ(floor.find(above), nullptr) << "another level is another floor";
}

TEST(SurfelFloor, SurfelOfASlopingCell) {
  SurfelFloor floor(0.2);
  SurfelCell& cell = floor.at_or_new({3, -2, 0});
  cell.height = 0.4;
  cell.slope = {0.1, -0.2};
  cell.parent_plane = 4;
  const Surfel surfel = floor.surfel({3, -2, 0});
  EXPECT_THAT(surfel.center, IsNear(Eigen::Vector3d(0.7, -0.3, 0.4), 1e-15));
  EXPECT_NEAR(M_PI * surfel.radius * surfel.radius, 0.04, 1e-15);
  EXPECT_EQ(surfel.parent_plane, 4);
  // Points of the cell's height function lie on the disc's plane.
  for (const auto& d : {Eigen::Vector2d(0.05, 0.02), Eigen::Vector2d(-0.1, 0.1)}) {
    const Eigen::Vector3d x(0.7 + d.x(), -0.3 + d.y(), 0.4 + cell.slope.dot(d));
    EXPECT_NEAR(surfel.normal.dot(x - surfel.center), 0, 1e-15);
  }
}

TEST(SurfelFloor, CovarianceOfTheSurfelIsConsistent) {
  SurfelFloor floor(0.2);
  SurfelCell truth;
  truth.height = 0.4;
  truth.slope = {0.3, -0.5};
  truth.covariance = some_covariance();
  const SurfelFloor::Key key{3, -2, 0};
  floor.at_or_new(key) = truth;
  const Surfel reference = floor.surfel(key);
  const Plane plane(reference.normal, 0);
  const Eigen::MatrixXd L = root_of(truth.covariance);
  const auto draw = [&](Random& random) {
    const Eigen::VectorXd step = L * random.normal_vector(3);
    SurfelCell& cell = floor.at_or_new(key);
    cell.height = truth.height + step(0);
    cell.slope = truth.slope + step.tail<2>();
    const Surfel drawn = floor.surfel(key);
    // The drawn disc's plane about the reference's centre.
    const Plane about(drawn.normal, drawn.normal.dot(drawn.center - reference.center));
    return ErrorAndCovariance{about.boxminus(plane), reference.covariance};
  };
  EXPECT_TRUE(is_consistent(draw, 1500));
}

TEST(ScanSegment, NormalOfThePlanePointsToTheScanner) {
  ScanSegment segment;
  segment.rho = 2;
  segment.theta = 0.3;
  segment.start = {2, -1};
  segment.end = {2, 1};
  EXPECT_NEAR(segment.length(), 2, 1e-15);
  const Eigen::Vector3d foot(2 * std::cos(0.3), 2 * std::sin(0.3), 0);
  const Plane plane(segment.normal_towards_scanner(), segment.normal_towards_scanner().dot(foot));
  EXPECT_GT(plane.signed_distance({0, 0, 0}), 0) << "the scanner is on the side it sees";
  EXPECT_NEAR(plane.rho(), -2, 1e-15);
}

TEST(PlanarMap, LabelsHaveNames) {
  EXPECT_STREQ(to_string(PlaneLabel::kFloor), "floor");
  EXPECT_STREQ(to_string(PlaneLabel::kRamp), "ramp");
  EXPECT_STREQ(to_string(PlaneLabel::kStep), "step");
  EXPECT_STREQ(to_string(PlaneLabel::kWall), "wall");
  EXPECT_STREQ(to_string(PlaneLabel::kCeiling), "ceiling");
  EXPECT_STREQ(to_string(PlaneLabel::kOther), "other");
}

TEST(PlanarMap, IsAValue) {
  PlanarMap map;
  map.planes.emplace_back().id = 3;
  map.trajectory.add(Timestamp::from_seconds(1), SE3());
  PlanarMap copy = map;
  copy.planes[0].id = 4;
  copy.trajectory.add(Timestamp::from_seconds(2), SE3());
  EXPECT_EQ(map.planes[0].id, 3);
  EXPECT_EQ(map.trajectory.size(), 1u);
  EXPECT_THAT(map.planes[0].plane_map, IsNear(Plane(), 0.0)) << "defaults are no garbage";
}

}  // namespace
}  // namespace lamina::test
