// What a robot may drive on: closed-form terrains against their own truth.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/rasterizer.hpp>
#include <lamina/models/error.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

TEST(Rasterizer, ALevelFloorIsFreeUpToItsEdge) {
  PlanarMap map;
  test::add_path(map, {-2, 0, 0}, {2, 0, 0});
  test::add_floor(map, {-2, -1}, {2, 1}, [](double, double) { return 0.0; });
  const NavigabilityGrid grid = rasterize(map);
  for (double x = -1.875; x < 1.9; x += 0.05) {
    for (double y = -0.875; y < 0.9; y += 0.05) {
      const NavigabilityCell cell = test::at(grid, x, y);
      ASSERT_EQ(cell.navigability, 1.0F) << x << " " << y;
      EXPECT_EQ(cell.height, 0.0F);
      EXPECT_EQ(cell.slope, 0.0F);
      EXPECT_EQ(cell.confidence, 1.0F);
    }
    EXPECT_FALSE(test::at(grid, x, 0.975).known()) << "the edge of what was seen";
    EXPECT_FALSE(test::at(grid, x, 1.2).known());
  }
}

TEST(Rasterizer, AScrapOfALevelPlaneAwayFromThePathIsNoFloorUnderIt) {
  PlanarMap map;
  test::add_path(map, {-2, 0, 0}, {2, 0, 0});
  test::add_floor(map, {6, 2}, {6.5, 2.5}, [](double, double) { return 0.3; });
  Rasterizer rasterizer{RasterOptions{}};
  rasterizer.update(map);
  EXPECT_TRUE(rasterizer.floor_seen());
  EXPECT_FALSE(rasterizer.floor_under_path());
  test::add_floor(map, {-2, -1}, {2, 1}, [](double, double) { return 0.0; });
  rasterizer.update(map);
  EXPECT_TRUE(rasterizer.floor_under_path());
}

TEST(Rasterizer, StepsUpToTAreDrivenHigherOnesBlockBothSides) {
  for (int mm = 1; mm <= 40; ++mm) {
    PlanarMap map;
    test::add_path(map, {-1, 0, 0}, {-0.5, 0, 0});
    const double step = 0.001 * mm;
    test::add_floor(map, {-1, -0.5}, {1, 0.5}, [&](double x, double) { return x < 0 ? 0 : step; });
    const NavigabilityGrid grid = rasterize(map);
    const bool climbs = mm <= 20;
    EXPECT_EQ(test::at(grid, -0.025, 0.0).navigability == 1.0F, climbs) << mm;
    EXPECT_EQ(test::at(grid, 0.025, 0.0).navigability > 0.0F, climbs) << mm;
    EXPECT_EQ(test::at(grid, -0.125, 0.0).navigability, 1.0F) << mm;
    EXPECT_NEAR(test::at(grid, 0.5, 0.0).height, step, 1e-6);
    // A higher floor that is not connected is worth less, as the floor article has it.
    const float up = climbs ? 1.0F : static_cast<float>(1 - step / 0.75);
    EXPECT_NEAR(test::at(grid, 0.5, 0.0).navigability, up, 1e-5) << mm;
  }
}

TEST(Rasterizer, SlopesLowerTheValueAndSteepOnesBlock) {
  float last = 1.0F;
  for (int deg = 0; deg <= 20; ++deg) {
    const double slope = deg * M_PI / 180;
    PlanarMap map;
    test::add_path(map, {0, -0.5, 0}, {0, 0.5, 0});
    test::add_floor(map, {-1, -0.5}, {1, 0.5},
                    [&](double x, double) { return x * std::tan(slope); });
    RasterOptions options;
    options.max_slope = 10.5 * M_PI / 180;
    const NavigabilityCell cell = test::at(rasterize(map, options), 0.325, 0.0);
    EXPECT_NEAR(cell.slope, slope, 1e-6);
    EXPECT_NEAR(cell.height, 0.325 * std::tan(slope), 1e-6);
    if (deg <= 10) {
      EXPECT_NEAR(cell.navigability, 1 - 0.8 * deg / 45.0, 1e-5) << deg;
    } else {
      EXPECT_EQ(cell.navigability, 0.0F) << deg;
    }
    EXPECT_LE(cell.navigability, last);
    last = cell.navigability;
  }
}

// The verdicts of a rough terrain against the rules written down plainly.
// Blocks of 0.1 m, up to 17.5 and 28 mm apart in height, no two level beside each other: nothing
// lies astride.
double rough(double x, double y) {
  const int i = static_cast<int>(std::floor(x / 0.1)), j = static_cast<int>(std::floor(y / 0.1));
  return (x < 0 ? 0.0025 : 0.004) * ((i + j * 3 + 1000) % 8);
}

// No step above T to any of the eight neighbours.
bool steps_fit(double x, double y) {
  bool fit = true;
  for (double dx : {-0.05, 0.0, 0.05}) {
    for (double dy : {-0.05, 0.0, 0.05}) {
      fit = fit && std::abs(rough(x, y) - rough(x + dx, y + dy)) <= 0.02 + 1e-9;
    }
  }
  return fit;
}

TEST(Rasterizer, EqualsBruteForceOnRoughTerrain) {
  PlanarMap map;
  test::add_path(map, {-1, 0, 0}, {1, 0, 0});
  test::add_floor(map, {-1.5, -1}, {1.5, 1}, rough);
  RasterOptions options;
  options.patch_size = 0;
  const NavigabilityGrid careful = rasterize(map, options);
  options.edge_margin = 0;
  const NavigabilityGrid exact = rasterize(map, options);
  int free = 0, blocked = 0, beside = 0;
  for (double x = -1.425; x < 1.4; x += 0.05) {
    for (double y = -0.925; y < 0.9; y += 0.05) {
      const bool expected = steps_fit(x, y);
      ASSERT_EQ(test::at(exact, x, y).navigability > 0, expected) << x << " " << y;
      ++(expected ? free : blocked);
      // With edges known to a cell: beside a cell with a step nobody knows.
      if (std::abs(x) > 1.36 || std::abs(y) > 0.86) continue;
      bool clear = true;
      for (double dx : {-0.05, 0.0, 0.05}) {
        for (double dy : {-0.05, 0.0, 0.05}) clear = clear && steps_fit(x + dx, y + dy);
      }
      const NavigabilityCell cell = test::at(careful, x, y);
      ASSERT_EQ(cell.navigability > 0, clear) << x << " " << y;
      ASSERT_EQ(cell.known(), clear || !expected) << x << " " << y;
      beside += expected && !clear;
    }
  }
  EXPECT_GT(free, 100);
  EXPECT_GT(blocked, 100);
  EXPECT_GT(beside, 100);
}

// Nothing rises by more than T within 0.2 m, borders of cells taken by their centres.
TEST(Rasterizer, RisesWithinAPatchEqualBruteForceOnRoughTerrain) {
  PlanarMap map;
  test::add_path(map, {-1, 0, 0}, {1, 0, 0});
  test::add_floor(map, {-1.5, -1}, {1.5, 1}, rough);
  RasterOptions options;
  options.edge_margin = 0;
  const NavigabilityGrid grid = rasterize(map, options);
  int free = 0, hidden = 0;
  for (double x = -1.375; x < 1.38; x += 0.05) {
    for (double y = -0.875; y < 0.88; y += 0.05) {
      double low = 1, high = -1;
      for (int i = -2; i <= 2; ++i) {
        for (int j = -2; j <= 2; ++j) {
          low = std::min(low, rough(x + 0.05 * i, y + 0.05 * j));
          high = std::max(high, rough(x + 0.05 * i, y + 0.05 * j));
        }
      }
      const bool level = high - low <= 0.02 + 1e-9;
      const NavigabilityCell cell = test::at(grid, x, y);
      ASSERT_EQ(cell.navigability > 0, steps_fit(x, y) && level) << x << " " << y;
      ASSERT_EQ(cell.known(), !steps_fit(x, y) || level) << x << " " << y;
      free += cell.navigability > 0;
      hidden += steps_fit(x, y) && !level;
    }
  }
  EXPECT_GT(free, 20);
  EXPECT_GT(hidden, 100);
}

// A step of 3 cm that patches lie astride looks like a ramp of 0.2 m. The slopes of the squares
// fit; only a plane says that it is a ramp.
TEST(Rasterizer, AStepThatPatchesLieAstrideIsNotFreeARampIs) {
  const auto slope = [](double x) { return std::clamp(0.03 - 0.15 * x, 0.0, 0.03); };
  const auto at = [&](double x, double plane_slope, int parent, double sigma = 0) {
    PlanarMap map;
    test::add_path(map, {-1.4, 0, 0.03}, {-0.5, 0, 0.03});
    test::add_floor(
        map, {-1.5, -0.5}, {1.5, 0.5}, [&](double u, double) { return slope(u); }, sigma);
    for (Surfel& s : map.surfels) s.parent_plane = parent;
    const Eigen::Vector3d n = Eigen::Vector3d(plane_slope, 0, 1).normalized();
    test::add_plane(map, Plane(n, 0.03 * n.z()),
                    {{-1.5, -0.5, 0.03 + 1.5 * plane_slope},
                     {1.5, -0.5, 0.03 - 1.5 * plane_slope},
                     {1.5, 0.5, 0.03 - 1.5 * plane_slope},
                     {-1.5, 0.5, 0.03 + 1.5 * plane_slope}});
    return test::at(rasterize(map), x, 0.025);
  };
  EXPECT_FALSE(at(0.125, 0, 0).navigability > 0) << "squares of a level plane";
  EXPECT_GT(at(0.125, 0.15, 0).navigability, 0.7F) << "squares of a ramp";
  EXPECT_FALSE(at(0.125, 0, -1).navigability > 0) << "no plane: squares lean astride a step, too";
  EXPECT_EQ(at(-0.425, 0, 0).navigability, 1.0F);
  EXPECT_EQ(at(0.725, 0.15, 0).navigability, 1.0F);
  EXPECT_FALSE(at(0.725, 0, 0).navigability > 0) << "below the step";
  EXPECT_GT(at(0.125, 0, 0, 0.005).navigability, 0.7F) << "within the noise of the two";
}

// Two squares without a surfel in a floor that was looked at: something there was no floor.
TEST(Rasterizer, APlaneFillsOneSquareMoreOnlyBesideAWall) {
  const auto middle = [](int missing, bool wall) {
    PlanarMap map;
    test::add_path(map, {-1, 0, 0}, {-0.5, 0, 0});
    test::add_floor(map, {-1, -0.5}, {1, 0.5}, [](double, double) { return 0.0; });
    std::erase_if(map.surfels, [missing](const Surfel& s) {
      return s.center.x() > 0 && s.center.x() < 0.1 * missing;
    });
    test::add_plate(map, {-1, -0.5}, {1, 0.5}, 0, true);
    if (wall) test::add_wall(map, {-0.2, 0.175}, {0.4, 0.175}, 0, 1);
    return test::at(rasterize(map), 0.05 * missing - 0.025, 0.025);
  };
  EXPECT_EQ(middle(1, false).navigability, 1.0F);
  EXPECT_TRUE(std::isnan(middle(2, false).height));
  EXPECT_EQ(middle(2, true).height, 0.0F);
}

// Far from the start poses leave a plane's height open by centimetres, but not where it lies by its
// own surfels: a gap of theirs that the plane fills is no step.
TEST(Rasterizer, AGapIsAsSureAsThePlanesOwnSurfelsAreLevelWithIt) {
  const auto gap = [](int parent, double above, double rough) {
    PlanarMap map;
    test::add_path(map, {-1, 0, above}, {1, 0, above});
    int k = 0;
    test::add_floor(
        map, {-1, -0.6}, {1, 0.6}, [&](double, double) { return above; }, 0.001);
    for (Surfel& s : map.surfels) {
      s.parent_plane = parent;
      s.center.z() += ++k % 2 == 0 ? rough : -rough;
    }
    std::erase_if(map.surfels, [](const Surfel& s) {
      return (s.center.head<2>() - Eigen::Vector2d(0.05, 0.05)).norm() < 0.01;
    });
    test::add_plate(map, {-1, -0.6}, {1, 0.6}, 0, true);
    map.planes[0].covariance(2, 2) = 0.02 * 0.02;
    return test::at(rasterize(map), 0.025, 0.025);
  };
  EXPECT_FALSE(gap(-1, 0, 0).known());
  EXPECT_EQ(gap(0, 0, 0).navigability, 1.0F);
  EXPECT_GT(gap(0, 0, 0).confidence, 0.95F);
  // Its surfels lie 1 cm above it: so does what fills their gap.
  EXPECT_GT(gap(0, 0.01, 0).navigability, 0.9F);
  EXPECT_NEAR(gap(0, 0.01, 0).height, 0.01, 1e-4);
  // They say nothing sure where they scatter as much themselves.
  EXPECT_FALSE(gap(0, 0, 0.009).known());
}

// The last disc before a wall reaches through it: behind there is nothing but the plane's outline.
TEST(Rasterizer, NothingIsFilledFromADiscAstrideAWall) {
  PlanarMap map;
  test::add_path(map, {-1, 0, 0}, {-0.5, 0, 0});
  test::add_floor(map, {-1, -0.5}, {0.1, 0.5}, [](double, double) { return 0.0; });
  test::add_plate(map, {-1, -0.5}, {1, 0.5}, 0, true);
  RasterOptions options;
  options.plane_gap = options.wall_gap;
  const auto behind = [&] { return test::at(rasterize(map, options), 0.175, 0.025); };
  EXPECT_EQ(behind().height, 0.0F) << "a gap of the floor";
  test::add_wall(map, {0.02, -1}, {0.02, 1}, 0, 1);
  EXPECT_TRUE(std::isnan(behind().height)) << "behind a wall";
  EXPECT_FALSE(behind().known());
  EXPECT_EQ(test::at(rasterize(map), -0.075, 0.025).navigability, 1.0F) << "before it";
}

TEST(Rasterizer, SaysWhatKeepsACellFromAVerdict) {
  PlanarMap map;
  test::add_path(map, {-1, 0, 0}, {1, 0, 0});
  test::add_floor(map, {-1, -0.5}, {0, 0.5}, [](double, double) { return 0.0; });
  test::add_floor(
      map, {0, -0.5}, {1, 0.5}, [](double, double) { return 0.0; }, 0.012);
  test::add_wall(map, {-0.5, -0.3}, {-0.5, 0.3}, 0, 1);
  Rasterizer rasterizer;
  rasterizer.update(map);
  const auto unknown_cause = [&](double x, double y) {
    return rasterizer.unknown_cause(cell_of({x, y}, 0.05));
  };
  EXPECT_EQ(unknown_cause(-0.225, 0.025), UnknownCause::kNone);
  EXPECT_EQ(unknown_cause(-0.5, 0.025), UnknownCause::kNone);  // the wall: blocked is a verdict
  EXPECT_EQ(unknown_cause(-0.225, 0.475), UnknownCause::kNeighbourNotSeen);
  EXPECT_EQ(unknown_cause(0.525, 0.025), UnknownCause::kStep);
  EXPECT_EQ(unknown_cause(5, 5), UnknownCause::kNotSeen);
}

TEST(Rasterizer, UncertainStepsAreNeitherFreeNorBlocked) {
  const auto middle = [](double sigma) {
    PlanarMap map;
    test::add_path(map, {-1, 0, 0}, {1, 0, 0});
    test::add_floor(
        map, {-1, -0.5}, {1, 0.5}, [](double, double) { return 0.0; }, sigma);
    return test::at(rasterize(map), 0.025, 0.025);
  };
  // P(|e| <= 20 mm) with e of sigma sqrt(2) s: 0.995 at 5 mm, 0.76 at 12 mm.
  EXPECT_EQ(middle(0.005).navigability, 1.0F);
  EXPECT_NEAR(middle(0.005).confidence, std::erf(0.02 / (0.005 * 2)), 1e-4);
  EXPECT_FALSE(middle(0.012).known());
  EXPECT_NEAR(middle(0.012).height, 0.0, 1e-6) << "the height stays";
}

TEST(Rasterizer, WallsBlockOverhangsAboveTheRobotDoNot) {
  for (const double bottom : {0.0, 0.5, 0.74, 0.8, 2.0}) {
    PlanarMap map;
    test::add_path(map, {-1, 0, 0}, {1, 0, 0});
    test::add_floor(map, {-1, -1}, {1, 1}, [](double, double) { return 0.0; });
    test::add_wall(map, {0.525, -1}, {0.525, 1}, bottom, 2.5);
    const NavigabilityGrid grid = rasterize(map);
    const NavigabilityCell cell = test::at(grid, 0.525, 0.0);
    EXPECT_EQ(cell.navigability, bottom < 0.75 ? 0.0F : 1.0F) << bottom;
    EXPECT_NEAR(cell.height, bottom < 0.75 ? 0.75 : 0.0, 1e-6);
    EXPECT_EQ(test::at(grid, 0.425, 0.0).navigability, 1.0F);
  }
}

// A box a robot could look down on has an edge to step off, however high; a wall has none.
TEST(Rasterizer, SurfacesWithinTheRobotsHeightAreStepsForTheCellsBesideThem) {
  for (const double top : {0.2, 0.4, 0.7}) {  // floors further apart than level_gap
    PlanarMap map;
    test::add_path(map, {-1, 0, 0}, {-0.5, 0, 0});
    test::add_floor(map, {-1, -1}, {1, 1}, [](double, double) { return 0.0; });
    test::add_plate(map, {0, -0.2}, {0.2, 0.2}, top, true);
    const NavigabilityGrid grid = rasterize(map);
    EXPECT_EQ(test::at(grid, 0.025, 0.0).navigability, 0.0F) << top;
    EXPECT_EQ(test::at(grid, -0.025, 0.0).navigability, 0.0F) << top;
    EXPECT_FALSE(test::at(grid, -0.075, 0.0).known()) << top;
    EXPECT_EQ(test::at(grid, -0.125, 0.0).navigability, 1.0F) << top;
  }
}

// The floor's plane reaches under furniture; nobody saw floor there.
TEST(Rasterizer, APlaneFillsNothingBehindAWall) {
  PlanarMap map;
  test::add_path(map, {-2, 0, 0}, {-1, 0, 0});
  test::add_floor(map, {-2, -1}, {0, 1}, [](double, double) { return 0.0; });
  test::add_plate(map, {-2, -1}, {0.5, 1}, 0, true);
  RasterOptions options;
  options.plane_gap = options.wall_gap;
  EXPECT_EQ(test::at(rasterize(map, options), 0.025, 0.0).navigability, 1.0F);
  test::add_wall(map, {0, -1}, {0, 1}, 0, 1);
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(test::at(grid, -0.125, 0.0).navigability, 1.0F);
  for (double x = -0.015; x < 0.5; x += 0.05) {
    EXPECT_FALSE(test::at(grid, x, 0.0).navigability > 0) << x;
  }
  // A lintel high above bars nothing.
  map.planes.pop_back();
  test::add_wall(map, {0, -1}, {0, 1}, 2, 2.5);
  EXPECT_EQ(test::at(rasterize(map, options), 0.025, 0.0).navigability, 1.0F);
}

TEST(Rasterizer, AFloorsPlaneAndAWallNeedNoSurfels) {
  PlanarMap map;
  test::add_path(map, {-0.5, 0, 0}, {0.5, 0, 0});
  test::add_plate(map, {-1, -1}, {1, 1}, 0, true);
  test::add_wall(map, {0.5, -1}, {0.5, 1}, 0, 1);
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(test::at(grid, 0.0, 0.0).navigability, 1.0F);
  EXPECT_EQ(test::at(grid, 0.51, 0.0).navigability, 0.0F);
}

TEST(Rasterizer, CeilingsAreAboveTableTopsAreNot) {
  PlanarMap map;
  test::add_path(map, {-1, 0, 0}, {1, 0, 0});
  test::add_floor(map, {-1, -1}, {1, 1}, [](double, double) { return 0.0; });
  test::add_plate(map, {-1, -1}, {1, 1}, 2.4, false);
  test::add_plate(map, {0.3, 0.3}, {0.7, 0.7}, 0.6, false);
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(test::at(grid, 0.0, 0.0).navigability, 1.0F);
  EXPECT_EQ(test::at(grid, 0.525, 0.525).navigability, 0.0F);
}

TEST(Rasterizer, OneLoosePointIsNoiseTwoAreAnObstacle) {
  PlanarMap map;
  test::add_path(map, {-1, 0, 0}, {1, 0, 0});
  test::add_floor(map, {-1, -1}, {1, 1}, [](double, double) { return 0.0; });
  map.loose_points = {{0.325, 0.325, 0.3},
                      {-0.325, 0.325, 0.3},
                      {-0.33, 0.32, 0.35},
                      {0.325, -0.325, 1.3},
                      {0.33, -0.33, 1.3}};
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(test::at(grid, 0.325, 0.325).navigability, 1.0F);
  EXPECT_EQ(test::at(grid, -0.325, 0.325).navigability, 0.0F);
  EXPECT_NEAR(test::at(grid, -0.325, 0.325).height, 0.35, 1e-6);
  EXPECT_EQ(test::at(grid, 0.325, -0.325).navigability, 1.0F) << "above the robot";
}

TEST(Rasterizer, NamesSettingsThatCannotBe) {
  RasterOptions options;
  options.resolution = 0;
  options.min_probability = 1.5;
  EXPECT_EQ(options.problems().size(), 2u);
  EXPECT_THROW(Rasterizer{options}, Error);
  EXPECT_TRUE(RasterOptions{}.problems().empty());
}

TEST(Rasterizer, NothingInNothingOut) {
  EXPECT_TRUE(rasterize(PlanarMap{}).empty());
  PlanarMap map;
  map.surfels.push_back({{NAN, 0, 0}, {0, 0, 1}, 0.05, Eigen::Matrix3d::Zero(), -1, -1});
  map.surfels.push_back({{1e300, 0, 0}, {0, 0, 1}, 0.05, Eigen::Matrix3d::Zero(), -1, -1});
  map.loose_points.emplace_back(0, NAN, 0);
  map.planes.emplace_back();
  EXPECT_TRUE(rasterize(map).empty());
}

}  // namespace
}  // namespace lamina
