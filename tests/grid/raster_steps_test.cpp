// Edges of low steps: discs astride, fills beside them, points on their faces.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/grid/rasterizer.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

// A step up at x = 1.05, in the middle of a row of discs, which lie astride: half as high as it.
PlanarMap astride(double rise, double sigma = 0) {
  PlanarMap map;
  test::add_path(map, {-0.8, 0, 0}, {0.5, 0, 0});
  const auto height = [&](double x, double) { return rise * (x < 1 ? 0 : x < 1.1 ? 0.4 : 1); };
  test::add_floor(map, {-1, -1}, {2.5, 1}, height, sigma);
  return map;
}

TEST(RasterSteps, DiscsAstrideAreOfOneSide) {
  for (const double rise : {0.01, 0.02, 0.03, 0.05, 0.1}) {
    const NavigabilityGrid grid = rasterize(astride(rise));
    for (double x = 0.725; x < 1.4; x += 0.05) {
      const double height = static_cast<double>(test::at(grid, x, 0.025).height);
      EXPECT_NEAR(height, x < 1.1 ? 0 : rise, 1e-6) << rise << " at " << x;
    }
    const bool climbs = rise <= 0.02;
    EXPECT_EQ(test::at(grid, 1.075, 0.025).navigability == 0.0F, !climbs) << rise;
  }
}

TEST(RasterSteps, WithinTheNoiseTheyStay) {
  const NavigabilityGrid grid = rasterize(astride(0.03, 0.004));
  EXPECT_NEAR(static_cast<double>(test::at(grid, 1.025, 0.025).height), 0.012, 1e-6);
}

// Storeys are not joined by what lies half-way.
TEST(RasterSteps, WhatIsHigherThanOneFloorIsNoStep) {
  const NavigabilityGrid grid = rasterize(astride(0.2));
  EXPECT_NEAR(static_cast<double>(test::at(grid, 1.075, 0.025).height), 0.08, 1e-6);
}

// The same heights along three decimetres and more are a short ramp.
TEST(RasterSteps, AShortRampStays) {
  for (const double length : {0.4, 0.6}) {
    PlanarMap map;
    test::add_path(map, {-0.8, 0, 0}, {0.5, 0, 0});
    const auto height = [&](double x, double) {
      return 0.04 * std::clamp((x - 1) / length, 0.0, 1.0);
    };
    test::add_floor(map, {-1, -1}, {2.5, 1}, height);
    const NavigabilityGrid grid = rasterize(map);
    for (double x = 0.725; x < 1.8; x += 0.05) {
      EXPECT_NEAR(static_cast<double>(test::at(grid, x, 0.025).height), height(x, 0), 0.003)
          << length << " at " << x;
    }
  }
}

// A ramp that a plane carries stays, however short.
TEST(RasterSteps, ARampOfAPlaneStays) {
  PlanarMap map;
  test::add_path(map, {-0.8, 0, 0}, {0.5, 0, 0});
  const double slope = 0.12;
  const auto height = [&](double x, double) { return slope * std::clamp(x - 1, 0.0, 0.2); };
  test::add_floor(map, {-1, -1}, {2.5, 1}, height);
  test::add_plane(map, Plane(Eigen::Vector3d(-slope, 0, 1).normalized(), 0),
                  {{1, -1, 0}, {1.2, -1, 0.2 * slope}, {1.2, 1, 0.2 * slope}, {1, 1, 0}});
  map.planes.back().plane_map =
      Plane(Eigen::Vector3d(-slope, 0, 1).normalized(), -slope / std::hypot(1, slope));
  for (Surfel& s : map.surfels) s.parent_plane = s.normal.z() < 0.999 ? 0 : -1;
  const NavigabilityGrid grid = rasterize(map);
  for (double x = 1.025; x < 1.2; x += 0.05) {
    EXPECT_NEAR(static_cast<double>(test::at(grid, x, 0.025).height), height(x, 0), 0.003) << x;
  }
}

// A plate of 2 cm that has no plane of its own, with a disc missing in its middle: the floor's
// plane fills that, as high as what lies around.
TEST(RasterSteps, AFillIsOfWhatLiesBesideIt) {
  PlanarMap map;
  test::add_path(map, {-0.8, 0, 0}, {0.5, 0, 0});
  test::add_floor(map, {-1, -1}, {2, 1}, [](double x, double y) {
    return x > 0.6 && x < 1.4 && std::abs(y) < 0.4 ? 0.02 : 0.0;
  });
  std::erase_if(map.surfels, [](const Surfel& s) {
    return std::abs(s.center.x() - 1.05) < 0.04 && std::abs(s.center.y() - 0.05) < 0.04;
  });
  test::add_plate(map, {-1, -1}, {2, 1}, 0, true);
  for (Surfel& s : map.surfels) s.parent_plane = 0;
  const NavigabilityGrid grid = rasterize(map);
  for (const double x : {1.025, 1.075}) {
    EXPECT_NEAR(static_cast<double>(test::at(grid, x, 0.025).height), 0.02, 1e-4) << x;
    EXPECT_GT(test::at(grid, x, 0.025).navigability, 0.9F) << x;
  }
}

// Points on a face, low and high, are as high as the top that begins there; noise at the edge is.
TEST(RasterSteps, PointsOnAFaceAreAsHighAsItsTop) {
  for (const double z : {0.03, 0.06, 0.09, 0.112}) {
    PlanarMap map;
    test::add_path(map, {-0.8, 0, 0}, {0.5, 0, 0});
    test::add_floor(map, {-1, -1}, {2, 1}, [](double x, double) { return x < 1 ? 0.0 : 0.1; });
    map.loose_points = {{0.99, 0.02, z}, {0.99, 0.03, z}};
    const NavigabilityGrid grid = rasterize(map);
    EXPECT_NEAR(static_cast<double>(test::at(grid, 0.975, 0.025).height), 0.1, 1e-5) << z;
  }
}

}  // namespace
}  // namespace lamina
