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

// A wall 3 m ahead with a doorway 1 m wide; every twentieth ray returns from 2 m behind its target.
void add_wall_with_strays(OccupancyGrid& grid, const OccupancyGrid* first_grid) {
  for (int scan = 0; scan < 24; ++scan) {
    std::vector<OccupancyBeam> beams;
    for (int k = 0; k < 200; ++k) {
      const double y = -3 + 0.03 * k + 0.013;
      const bool doorway = std::abs(y) < 0.5, stray = (7 * k + 3 * scan) % 20 == 0;
      const double x = (doorway ? 6.0 : 3.01) + (stray ? 2.0 : 0.0);
      beams.push_back({{x, y * x / 3.01}, 0.01, true});
    }
    grid.add(SE3(SO3(), {0.01, 0.02 * scan / 24, 0.4}), beams, 0, first_grid);
  }
}

TEST(OccupancyGrid, StrayReturnsClearAndMarkNothingBehindWalls) {
  OccupancyGrid first, second;
  add_wall_with_strays(first, nullptr);
  add_wall_with_strays(second, &first);
  int through = 0, behind = 0, known = 0;
  for (int i = 0; i < 50; ++i) {
    for (int j = -40; j < 40; ++j) {
      const Eigen::Vector2d p(3.4 + 0.05 * i, 0.05 * j);
      const float before = first.probability(cell_of(p, 0.05));
      const float after = second.probability(cell_of(p, 0.05));
      const double at_wall = std::abs(p.y()) * 3.01 / p.x();
      if (i < 20 && at_wall < 0.4) through += after < 0.196F ? 0 : 1;
      if (at_wall < 0.6) continue;
      ++behind;
      EXPECT_TRUE(std::isnan(after)) << p.transpose();
      known += std::isnan(before) ? 0 : 1;
    }
  }
  EXPECT_GT(known, behind / 2);  // the fault was there to be mended
  EXPECT_EQ(through, 0);         // what is seen through the doorway stays
  EXPECT_GT(second.probability(cell_of({3.02, -1.0}, 0.05)), 0.65F);
}

// A wall along x at y = 0.52, seen at a grazing angle: each ray crosses cells others ended in.
TEST(OccupancyGrid, GrazedWallsKeepTheirMarks) {
  OccupancyGrid first, second;
  for (OccupancyGrid* grid : {&first, &second}) {
    for (int scan = 0; scan < 20; ++scan) {
      std::vector<OccupancyBeam> beams;
      for (int k = 0; k < 60; ++k) {
        const double angle = (k + 1.5) * M_PI / 180, x = 0.52 / std::tan(angle);
        beams.push_back({{x, 0.52}, 0.01, true});
      }
      grid->add(SE3(SO3(), {0.1 * scan, 0, 0.4}), beams, 0, grid == &second ? &first : nullptr);
    }
  }
  int marked = 0, solid = 0;
  first.cells().for_each([&](const CellIndex& c, const OccupancyCell&) {
    const float before = first.probability(c);
    solid += first.solid(c) ? 1 : 0;
    if (!(before > 0.65F)) return;
    ++marked;
    EXPECT_GT(second.probability(c), 0.65F) << c.i << " " << c.j;
  });
  EXPECT_GT(marked, 60);
  EXPECT_GT(solid, 20);
}

// A door 0.9 m wide, open in the first scans and shut in twice as many.
TEST(OccupancyGrid, WhatWasSeenThroughADoorThatIsShutNowStays) {
  OccupancyGrid first, second;
  for (OccupancyGrid* grid : {&first, &second}) {
    for (int scan = 0; scan < 30; ++scan) {
      const bool open = scan < 10;
      std::vector<OccupancyBeam> beams;
      for (int k = -40; k <= 40; ++k) {
        const double t = std::tan(k * M_PI / 180);
        const double x = open && std::abs(2.01 * t) < 0.45 ? 5.01 : 2.01;
        beams.push_back({{x, x * t}, 0.01, true});
      }
      grid->add(SE3(SO3(), {0.01, 0.01, 0.4}), beams, 0, grid == &second ? &first : nullptr);
    }
  }
  EXPECT_TRUE(first.solid(cell_of({2.02, 0.01}, 0.05)));
  for (const double x : {2.5, 3.0, 4.0, 4.8})
    EXPECT_LT(second.probability(cell_of({x, 0.01}, 0.05)), 0.196F) << x;
  EXPECT_GT(second.probability(cell_of({5.02, 0.01}, 0.05)), 0.65F);
  EXPECT_GT(second.probability(cell_of({2.02, 0.01}, 0.05)), 0.65F);
}

TEST(OccupancyGrid, WhatNoLongerStandsIsNotSolid) {
  OccupancyGrid grid;
  const SE3 scanner(SO3(), {0, 0, 0.4});
  for (int i = 0; i < 30; ++i) grid.add(scanner, {{{2.01, 0.01}, 0.01, true}});
  EXPECT_TRUE(grid.solid(cell_of({2.01, 0.01}, 0.05)));
  for (int i = 0; i < 14; ++i) grid.add(scanner, {{{4.01, 0.01}, 0.01, true}});
  EXPECT_FALSE(grid.solid(cell_of({2.01, 0.01}, 0.05)));  // 14 of 44 went through, the last of all
}

TEST(OccupancyGrid, SenselessBeamsDoNothing) {
  OccupancyGrid grid;
  grid.add(SE3(), {{{0, 0}, 0.01, true}, {{NAN, 1}, 0.01, true}, {{INFINITY, 0}, 0.01, true}});
  EXPECT_TRUE(grid.bounds().empty());
}

}  // namespace
}  // namespace lamina
