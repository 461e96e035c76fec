// The pyramid bounds what it should, and branch and bound finds what exhaustive search finds.
#include <gmock/gmock.h>

#include <lamina/frontend/motion/likelihood_grid.hpp>
#include <lamina/frontend/motion/scan_points.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

std::vector<Eigen::Vector2d> room_points(const SE3& T) {
  testing::Scanner scanner;
  scanner.beams = 121;
  std::vector<Eigen::Vector2d> points;
  for (const OrientedPoint& p : oriented_points(scanner.scan(testing::room(), T, 0))) {
    points.push_back(p.point);
  }
  return points;
}

TEST(LikelihoodGrid, EachLevelIsTheMaximumOverItsWindow) {
  const LikelihoodGrid grid({{0, 0}, {1, 0.5}, {0.3, 1.2}}, 0.1, 0.1, 4);
  for (int level = 0; level < 4; ++level) {
    for (int y = -12; y < 30; ++y) {
      for (int x = -12; x < 30; ++x) {
        int most = 0;
        for (int dy = 0; dy < 1 << level; ++dy) {
          for (int dx = 0; dx < 1 << level; ++dx) most = std::max(most, grid.at(0, x + dx, y + dy));
        }
        ASSERT_EQ(grid.at(level, x, y), most) << level << ' ' << x << ' ' << y;
      }
    }
  }
}

TEST(LikelihoodGrid, BranchAndBoundEqualsExhaustiveSearch) {
  const auto map = room_points(SE3()), scan = room_points(SE3::planar(0.35, -0.42, 0.1));
  const LikelihoodGrid deep(map, 0.1, 0.1, 5), flat(map, 0.1, 0.1, 1);
  SearchWindow window;
  window.translation = 1.0;
  window.rotation = 0.2;
  const auto fast = search_correlative(deep, scan, {}, window, 0.2);
  const auto slow = search_correlative(flat, scan, {}, window, 0.2);
  ASSERT_TRUE(fast && slow);
  EXPECT_DOUBLE_EQ(fast->score, slow->score);
  EXPECT_NEAR(fast->T_map_scan.x, 0.35, 0.11);
  EXPECT_NEAR(fast->T_map_scan.y, -0.42, 0.11);
  EXPECT_NEAR(fast->T_map_scan.yaw, 0.1, 0.03);
}

TEST(LikelihoodGrid, ExclusionFindsTheSecondBest) {
  const auto map = room_points(SE3());
  const LikelihoodGrid grid(map, 0.1, 0.1, 5);
  SearchWindow window;
  const auto best = search_correlative(grid, map, {}, window, 0.2);
  ASSERT_TRUE(best);
  window.exclude = best->T_map_scan;
  const auto second = search_correlative(grid, map, {}, window, 0.1);
  ASSERT_TRUE(second);
  EXPECT_LT(second->score, 0.8 * best->score);
  EXPECT_GT((second->T_map_scan.translation() - best->T_map_scan.translation()).norm() +
                std::abs(second->T_map_scan.yaw - best->T_map_scan.yaw),
            0.2);
}

TEST(LikelihoodGrid, NothingGoodEnoughIsNothing) {
  const LikelihoodGrid grid({{50, 50}}, 0.1, 0.1, 3);
  EXPECT_FALSE(search_correlative(grid, {{0, 0}}, {}, {}, 0.2));
  EXPECT_FALSE(search_correlative(grid, {}, {}, {}, 0.2));
  EXPECT_FALSE(search_correlative(LikelihoodGrid({}, 0.1, 0.1, 3), {{0, 0}}, {}, {}, 0.2));
}

}  // namespace
}  // namespace lamina
