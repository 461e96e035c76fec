// Leaning scanners in a room with a floor, by ray casting.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include <lamina/frontend/segments/ground_returns.hpp>
#include <lamina/pipeline/calibration/ground_lean.hpp>

#include "frontend/segments/leaning_scan.hpp"

namespace lamina {
namespace {

using testing::kDegree;
using testing::leaning_scan;
using testing::mounted;

// Round and round, 0.1 rad a scan; what the ground tells of the mounting.
std::optional<MountingCorrection> observed(const SE3& truth, const SE3& stated, double step = 0.1) {
  GroundLean lean;
  std::mt19937 rng(3);
  for (int i = 0; i < 80; ++i) {
    const SE3 body = SE3::planar(2 * std::cos(0.1 * i), 1.5 * std::sin(0.1 * i), step * i);
    lean.add(leaning_scan(body, truth, stated, rng), step);
  }
  return lean.correction();
}

TEST(GroundReturns, TheGroundGoesAndWallsStay) {
  std::mt19937 rng(1);
  const SE3 mount = mounted(0.3, 6 * kDegree);
  LaserScan s = leaning_scan(SE3(), mount, mount, rng);
  const LaserScan before = s;
  const int removed = remove_ground(s);
  EXPECT_GT(removed, 40);
  int walls = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const Eigen::Vector2d p = before.point(i);
    const double z = (mount * Eigen::Vector3d(p.x(), p.y(), 0)).z();
    EXPECT_TRUE(z >= 0.02 || !s.valid(i)) << i;
    walls += s.valid(i);
  }
  EXPECT_GT(walls, 100);  // all behind and most beside
}

TEST(GroundReturns, LevelScannersAndHeightsNobodyStatedAreLeftAlone) {
  std::mt19937 rng(1);
  const SE3 level = mounted(0.3, 0), low = mounted(0, 6 * kDegree);
  LaserScan s = leaning_scan(SE3(), level, level, rng);
  EXPECT_EQ(remove_ground(s), 0);
  s = leaning_scan(SE3(), mounted(0.3, 6 * kDegree), low, rng);
  EXPECT_EQ(remove_ground(s), 0);
  LaserScan empty;
  EXPECT_EQ(remove_ground(empty), 0);
}

// Said to lean by 10 degrees, it is level: beams pass where the ground should stop them.
TEST(GroundReturns, AWrongLeanTakesNothing) {
  std::mt19937 rng(1);
  LaserScan s = leaning_scan(SE3(), mounted(0.3, 0), mounted(0.3, 10 * kDegree), rng);
  EXPECT_EQ(remove_ground(s), 0);
}

TEST(GroundLean, IsFoundWhicheverWayItGoes) {
  const std::array<std::array<double, 2>, 3> leans{{{0, 3}, {-3, 2}, {-2.5, -4}}};
  for (const auto& [pitch, roll] : leans) {
    const SE3 truth = mounted(0.2, pitch * kDegree, roll * kDegree), stated = mounted(0.2, 0);
    const auto found = observed(truth, stated);
    ASSERT_TRUE(found) << pitch << " " << roll;
    const SE3 mended = found->apply(stated);
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    const double off = std::acos((mended.so3().inverse() * up).dot(truth.so3().inverse() * up));
    EXPECT_LT(off, 0.15 * kDegree) << pitch << " " << roll;
    EXPECT_EQ(found->translation_body.norm(), 0);
    EXPECT_LT(std::abs(found->rotation_body.z()), 0.2 * kDegree);
  }
}

TEST(GroundLean, MountingsThatAreRightStay) {
  EXPECT_FALSE(observed(mounted(0.2, 0), mounted(0.2, 0)));
  EXPECT_FALSE(observed(mounted(0.2, 4 * kDegree), mounted(0.2, 4 * kDegree)));
  EXPECT_FALSE(
      observed(mounted(0.6, 1 * kDegree), mounted(0.6, 0)));  // meets no ground in the room
  EXPECT_FALSE(observed(mounted(0.01, 2 * kDegree), mounted(0.01, 0)));  // nobody stated a height
}

// Straight ahead a wall stands still in the scanner as the ground does.
TEST(GroundLean, OnlyTurnsTell) {
  EXPECT_FALSE(observed(mounted(0.2, 4 * kDegree), mounted(0.2, 0), 0));
  EXPECT_FALSE(GroundLean().correction());
}

TEST(GroundLean, SeveralScannersAreLeftAlone) {
  GroundLean lean;
  std::mt19937 rng(3);
  const SE3 truth = mounted(0.2, 4 * kDegree);
  for (int i = 0; i < 80; ++i) {
    const SE3 stated = i % 2 ? mounted(0.2, 0) : mounted(0.2, 0.01);
    lean.add(leaning_scan(SE3::planar(0, 0, 0.1 * i), truth, stated, rng), 0.1);
  }
  EXPECT_FALSE(lean.correction());
}

}  // namespace
}  // namespace lamina
