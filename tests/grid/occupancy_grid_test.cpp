// Rays clear what they cross and mark where they end.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/occupancy_grid.hpp>

namespace lamina {
namespace {

const SE3 kScanner = SE3(SO3::rot_z(0.3), {0.51, -0.22, 0.4});

TEST(OccupancyGrid, ClearsAlongTheRayAndMarksItsEnd) {
  OccupancyGrid grid;
  const Eigen::Vector2d end_scan(3.0, 0.5);
  for (int i = 0; i < 4; ++i) grid.add(kScanner, {{end_scan, 0.01, true}});
  const Eigen::Vector2d start = kScanner.translation().head<2>();
  const Eigen::Vector2d end = (kScanner * Eigen::Vector3d(end_scan.x(), end_scan.y(), 0)).head<2>();
  EXPECT_GT(grid.probability(cell_of(end, 0.05)), 0.9f);
  for (const double share : {0.0, 0.3, 0.6, 0.9}) {
    const Eigen::Vector2d on_ray = start + share * (end - start);
    EXPECT_LT(grid.probability(cell_of(on_ray, 0.05)), 0.196f) << share;
  }
  const Eigen::Vector2d beyond = start + 1.1 * (end - start);
  EXPECT_TRUE(std::isnan(grid.probability(cell_of(beyond, 0.05))));
}

TEST(OccupancyGrid, ARayWithoutObstacleClearsOnly) {
  OccupancyGrid grid;
  for (int i = 0; i < 4; ++i) grid.add(SE3(SO3(), {0, 0, 0.4}), {{{2.0, 0.0}, 0.01, false}});
  EXPECT_LT(grid.probability(cell_of({1.99, 0.01}, 0.05)), 0.196f);
}

TEST(OccupancyGrid, ARayIntoTheFloorMarksAndClearsNothingBeyondTheBand) {
  OccupancyGrid grid;
  // Looks down by 0.2 rad from 0.4 m: meets the floor at 2 m.
  const SE3 T_map_scan(SO3::rot_y(0.2), {0, 0, 0.4});
  const double range = 0.4 / std::sin(0.2);
  for (int i = 0; i < 4; ++i) grid.add(T_map_scan, {{{range, 0.0}, 0.01, true}});
  EXPECT_LT(grid.probability(cell_of({0.5, 0.01}, 0.05)), 0.196f);
  const double end_x = range * std::cos(0.2);
  EXPECT_TRUE(std::isnan(grid.probability(cell_of({end_x, 0.0}, 0.05))));
}

TEST(OccupancyGrid, TheBandIsOverTheGroundOfTheScanner) {
  OccupancyOptions options;
  options.max_height = 0.75;
  OccupancyGrid grid(options);
  const SE3 upstairs(SO3(), {0, 0, 3.4});
  for (int i = 0; i < 4; ++i) grid.add(upstairs, {{{2.0, 0.0}, 0.01, true}});
  EXPECT_TRUE(std::isnan(grid.probability(cell_of({1.0, 0.0}, 0.05))));
  for (int i = 0; i < 4; ++i) grid.add(upstairs, {{{2.0, 0.0}, 0.01, true}}, 3.0);
  EXPECT_LT(grid.probability(cell_of({1.0, 0.0}, 0.05)), 0.196f);
  EXPECT_GT(grid.probability(cell_of({2.0, 0.0}, 0.05)), 0.9f);
}

TEST(OccupancyGrid, AMarkIsNotClearedByTheNeighbourOfTheSameScan) {
  OccupancyGrid grid;
  std::vector<OccupancyBeam> beams;
  // A wall seen along its length: rays of later beams graze cells that earlier ones ended in.
  for (int i = 0; i < 200; ++i) {
    const double x = 0.5 + 0.02 * i;
    beams.push_back({{x, 0.3}, 0.01, true});
  }
  for (int i = 0; i < 3; ++i) grid.add(SE3(SO3(), {0, 0, 0.4}), beams);
  for (int i = 0; i < 200; i += 10) {
    EXPECT_GT(grid.probability(cell_of({0.5 + 0.02 * i, 0.3}, 0.05)), 0.65f) << i;
  }
}

TEST(OccupancyGrid, SenselessBeamsDoNothing) {
  OccupancyGrid grid;
  grid.add(SE3(), {{{0, 0}, 0.01, true}, {{NAN, 1}, 0.01, true}, {{INFINITY, 0}, 0.01, true}});
  EXPECT_TRUE(grid.bounds().empty());
}

}  // namespace
}  // namespace lamina
