// When drift explains a match of two submaps, and when it does not.
#include <gtest/gtest.h>

#include <lamina/frontend/loops/submap_pair.hpp>

namespace lamina {
namespace {

constexpr double kMost = 25;  // chi-squared

// Two walls, from corner to corner.
std::vector<OrientedPoint> corner() {
  std::vector<OrientedPoint> points;
  for (int i = 0; i < 100; ++i) {
    points.push_back({{0.04 * i, 2}, {0, -1}});
    points.push_back({{4, 2 - 0.04 * i}, {-1, 0}});
  }
  return points;
}

Eigen::Matrix3d small() { return Eigen::Vector3d(4e-4, 4e-4, 1e-5).asDiagonal(); }

// Place and heading err together: 0.3 m sideways for 0.1 rad.
Eigen::Matrix3d bound_together() {
  Eigen::Matrix3d C = small();
  C.bottomRightCorner<2, 2>() << 0.09, 0.03 * 0.999, 0.03 * 0.999, 0.01;
  return C;
}

struct Fixture {
  PointMap old_points{corner()};
  std::vector<SightFan> fans;
  SubmapViews newer{corner(), {}};
  SubmapPair pair{old_points, fans, newer};
};

TEST(SubmapPair, AlignsTheSameCorner) {
  const Fixture f;
  const LineMatch match = f.pair.align({0.1, -0.1, 0.05});
  EXPECT_LT(difference({}, match.T_map_scan).norm(), 1e-3);
  EXPECT_EQ(match.unknown_directions, 0);
}

TEST(SubmapPair, DriftExplainsWhatIsNear) {
  const Fixture f;
  const PlanarPose match{0.03, 0.02, 0.005};
  EXPECT_TRUE(f.pair.consistent({{}, small()}, {match, small()}, kMost));
  EXPECT_FALSE(f.pair.consistent({{}, small()}, {{1, 0, 0}, small()}, kMost));
}

// Sideways and no turn: impossible together, likely each by its own. It is one place if a match
// from where drift led ends there.
TEST(SubmapPair, PlaceAndHeadingApartWhereAMatchReaches) {
  const Fixture f;
  const PlanarPose drift{0, 0.25, 0};
  EXPECT_TRUE(f.pair.consistent({drift, bound_together()}, {{}, small()}, kMost));
  const PlanarPose alike{0, 0.5, 0};  // where the same match does not end
  EXPECT_FALSE(f.pair.consistent({drift, bound_together()}, {alike, small()}, kMost));
}

}  // namespace
}  // namespace lamina
