// Holes, levels, and maps that change: what is redrawn equals what is drawn from scratch.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/grid/rasterizer.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

double flat(double, double) { return 0.0; }

/// Cells that differ in any bit of any layer (all NaN are one).
int differences(const NavigabilityGrid& a, const NavigabilityGrid& b) {
  const auto same = [](float x, float y) { return x == y || (x != x && y != y); };
  int count = 0;
  const auto compare = [&](const NavigabilityGrid& one, const NavigabilityGrid& other) {
    one.for_each([&](const CellIndex& c, const NavigabilityCell& x) {
      const NavigabilityCell* found = other.find(c);
      const NavigabilityCell y = found == nullptr ? NavigabilityCell{} : *found;
      count += !same(x.height, y.height) || !same(x.slope, y.slope) ||
               !same(x.navigability, y.navigability) || !same(x.confidence, y.confidence);
    });
  };
  compare(a, b);
  compare(b, a);
  return count;
}

void add_ring(PlanarMap& map, double radius) {
  for (double a = 0; a < 2 * M_PI; a += 0.03 / radius) {
    map.edges.push_back({{radius * std::cos(a), radius * std::sin(a), 0}, 0.02, true});
  }
}

int free_within(const NavigabilityGrid& grid, double radius) {
  int count = 0;
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    count += center_of(c, 0.05).norm() < radius && cell.navigability > 0;
  });
  return count;
}

TEST(RasterHoles, ASeenPitIsNeverFree) {
  for (const double depth : {0.03, 0.1, 0.2, 0.5, 2.0}) {
    PlanarMap map;
    test::add_path(map, {-2.4, 0, 0}, {-1.5, 0, 0});
    test::add_floor(map, {-2.5, -2}, {2, 2}, [depth](double x, double y) {
      return std::abs(x) < 1 && std::abs(y) < 1 ? -depth : 0.0;
    });
    const NavigabilityGrid grid = rasterize(map);
    EXPECT_EQ(free_within(grid, 0.97), 0) << depth;
    EXPECT_EQ(test::at(grid, 0.025, 0.025).navigability, 0.0F) << depth;
    EXPECT_EQ(test::at(grid, -1.525, 0.025).navigability, 1.0F) << depth;
  }
}

// A plane's outline does not tell holes; its surfels do, and so do rims.
TEST(RasterHoles, AnUnseenHoleInAPlaneIsNeverFree) {
  PlanarMap map;
  test::add_path(map, {-2.9, 0, 0}, {-2.5, 0, 0});
  test::add_floor(map, {-3, -3}, {3, 3}, flat);
  std::erase_if(map.surfels, [](const Surfel& s) { return s.center.head<2>().norm() < 2; });
  test::add_plate(map, {-3, -3}, {3, 3}, 0, true);
  EXPECT_EQ(free_within(rasterize(map), 1.7), 0);

  map.surfels.clear();
  EXPECT_GT(free_within(rasterize(map), 1.7), 3000) << "a plane alone is floor";
  add_ring(map, 2.0);
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(free_within(grid, 2.0), 0);
  EXPECT_EQ(test::at(grid, -2.525, 0.025).navigability, 1.0F);
}

// Surfels on the bottom: images looked through the plane's outline there.
TEST(RasterHoles, AFloorsPlaneFillsNoPitOfWhichSomeOfTheBottomWasSeen) {
  PlanarMap map;
  test::add_path(map, {-2.9, 0, 0}, {-2.5, 0, 0});
  test::add_floor(map, {-3, -3}, {3, 3}, flat);
  std::erase_if(map.surfels, [](const Surfel& s) { return s.center.head<2>().norm() < 2; });
  for (Surfel& s : map.surfels) s.parent_plane = 0;
  test::add_plate(map, {-3, -3}, {3, 3}, 0, true);
  test::add_floor(map, {-1.2, -1.6}, {1.2, -0.8}, [](double, double) { return -0.8; });
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(free_within(grid, 1.7), 0);
  EXPECT_EQ(test::at(grid, -2.525, 0.025).navigability, 1.0F);
}

// Told by their numbers alone: tiles that no changed surfel lies in are drawn again.
TEST(RasterUpdate, APlaneWithSurfelsOfItsOwnIsFloorOnlyNearThem) {
  PlanarMap map;
  test::add_path(map, {-2.9, 0, 0}, {2.5, 0, 0});
  test::add_floor(map, {-3, -3}, {-2, 3}, flat);
  test::add_plate(map, {-3, -3}, {3, 3}, 0, true);
  Rasterizer rasterizer;
  RasterChanges all;
  for (std::size_t k = 0; k < map.surfels.size(); ++k) all.surfels.push_back(k);
  rasterizer.update(map);
  for (const std::int64_t parent : {0, -1, 0}) {
    for (Surfel& s : map.surfels) s.parent_plane = static_cast<int>(parent);
    rasterizer.update(map, all);
    EXPECT_EQ(differences(rasterizer.grid(), rasterize(map)), 0);
    EXPECT_EQ(free_within(rasterizer.grid(), 1.5) > 0, parent < 0);
  }
}

TEST(RasterHoles, APlankOverAPitMakesItFreeAgain) {
  PlanarMap map;
  test::add_path(map, {-1.9, 0, 0}, {-1.5, 0, 0});
  test::add_floor(map, {-2, -2}, {2, 2}, flat);
  PlanarMap pit = map;
  std::erase_if(pit.surfels, [](const Surfel& s) { return s.center.head<2>().norm() < 0.8; });
  add_ring(pit, 0.8);
  Rasterizer rasterizer;
  rasterizer.update(pit);
  EXPECT_EQ(free_within(rasterizer.grid(), 0.8), 0);
  map.edges = pit.edges;  // the rims' observations remain; the floor is seen on all sides of them
  rasterizer.update(map);
  EXPECT_GT(free_within(rasterizer.grid(), 0.8), 750);
  EXPECT_EQ(differences(rasterizer.grid(), rasterize(map)), 0);
}

// A rim where floor is seen on all sides is none; one beside a square that nobody saw stays,
// whatever the floor's plane fills.
TEST(RasterHoles, ARimAmidSeenFloorIsNoneOneBesideAGapStays) {
  const auto at_rim = [](double gap_x) {
    PlanarMap map;
    test::add_path(map, {-1.9, 0, 0}, {-1.5, 0, 0});
    test::add_floor(map, {-2, -1}, {1, 1}, flat);
    std::erase_if(map.surfels, [gap_x](const Surfel& s) {
      return (s.center.head<2>() - Eigen::Vector2d(gap_x, 0.05)).norm() < 0.01;
    });
    test::add_plate(map, {-2, -1}, {1, 1}, 0, true);
    map.edges.push_back({{0.025, 0.025, 0}, 0.01, true});
    return test::at(rasterize(map), 0.025, 0.025).navigability;
  };
  EXPECT_EQ(at_rim(0.55), 1.0F);
  EXPECT_EQ(at_rim(0.15), 1.0F) << "two cells away";
  EXPECT_EQ(at_rim(-0.05), 0.0F) << "beside it";
  EXPECT_EQ(at_rim(0.05), 0.0F) << "in it";
}

TEST(RasterLevels, ABridgeAboveTheRobotIsNoObstacle) {
  for (const double height : {0.5, 2.2}) {
    PlanarMap map;
    test::add_path(map, {-1.9, 0, 0}, {1.9, 0, 0});
    test::add_floor(map, {-2, -1}, {2, 1}, flat);
    test::add_floor(map, {-0.5, -1}, {0.5, 1}, [height](double, double) { return height; });
    const NavigabilityGrid grid = rasterize(map);
    EXPECT_EQ(test::at(grid, 0.025, 0.025).navigability, height > 1 ? 1.0F : 0.0F);
    EXPECT_NEAR(test::at(grid, 0.025, 0.025).height, height > 1 ? 0.0 : height, 1e-6);
  }
}

TEST(RasterLevels, ARampLeadsToAStoreyOfFullValue) {
  PlanarMap map;
  test::add_path(map, {-1.9, 0, 0}, {-1, 0, 0});
  const auto height = [](double x, double) { return std::clamp(0.1 * x, 0.0, 1.0); };
  test::add_floor(map, {-2, -0.5}, {12, 0.5}, height);
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(test::at(grid, 11.025, 0.025).navigability, 1.0F);
  EXPECT_NEAR(test::at(grid, 11.025, 0.025).height, 1.0, 1e-6);
  EXPECT_NEAR(test::at(grid, 5.025, 0.025).navigability, 1 - 0.8 * std::atan(0.1) / (M_PI / 4),
              1e-5);
}

// The floor on both sides of a ramp has an outline around both: images that saw the ramp saw no
// floor under it.
TEST(RasterLevels, AFloorsPlaneFillsNothingUnderARampItSurrounds) {
  PlanarMap map;
  test::add_path(map, {-2.9, 0, 0}, {-1, 0, 0});
  test::add_path(map, {-1, 0, 0}, {2.9, 0, 0.39});
  const auto on_ramp = [](double x, double y) { return x > -1 && std::abs(y) < 0.5; };
  test::add_floor(map, {-3, -3}, {3, 3}, flat);
  std::erase_if(map.surfels, [&](const Surfel& s) { return on_ramp(s.center.x(), s.center.y()); });
  for (Surfel& s : map.surfels) s.parent_plane = 0;
  test::add_plate(map, {-3, -3}, {3, 3}, 0, true);
  test::add_floor(map, {-1, -0.5}, {3, 0.5}, [](double x, double) { return 0.1 * (x + 1); });
  const NavigabilityGrid grid = rasterize(map);
  for (const double x : {0.025, 1.025, 2.525}) {
    EXPECT_GT(test::at(grid, x, 0.025).navigability, 0.5F) << x;
    EXPECT_NEAR(test::at(grid, x, 0.025).height, 0.1 * (x + 1), 1e-3) << x;
  }
  EXPECT_EQ(test::at(grid, 0.025, 2.025).navigability, 1.0F) << "floor beside it";
}

// A ramp whose outline reaches on over the floor before it (noisy images from afar): it stood as a
// bar across the floor's gaps where it lies a level's gap above it.
TEST(RasterLevels, ARampsOutlineOverTheFloorIsNoBar) {
  PlanarMap map;
  test::add_path(map, {-2.9, 0, 0}, {2.9, 0, 0});
  test::add_floor(map, {-3, -1}, {3, 1},
                  [](double x, double) { return std::abs(x - 0.55) < 0.15 ? 0.012 : 0.0; });
  std::erase_if(map.surfels, [](const Surfel& s) { return std::abs(s.center.x() - 0.55) < 0.04; });
  for (Surfel& s : map.surfels) s.parent_plane = 0;
  test::add_plate(map, {-3, -1}, {3, 1}, 0, true);
  Surfel on_ramp = test::surfel_at(2.95, 1.95, 0.395, Eigen::Vector3d(-0.1, 0, 1).normalized());
  on_ramp.parent_plane = 1;
  map.surfels.push_back(on_ramp);
  const Eigen::Vector3d& normal = on_ramp.normal;
  test::add_plane(map, Plane(normal, normal.z() * 0.1),
                  {{-3, -1, -0.2}, {3, -1, 0.4}, {3, 2, 0.4}, {-3, 2, -0.2}});
  const NavigabilityGrid grid = rasterize(map);
  for (double x = 0.025; x < 1; x += 0.05)
    EXPECT_EQ(test::at(grid, x, 0.025).navigability, 1.0F) << x;
}

TEST(RasterLevels, WithoutAPathTheLargestFloorIsTheFloor) {
  PlanarMap map;
  test::add_floor(map, {-1, -1}, {1, 1}, [](double, double) { return 3.0; });
  test::add_floor(map, {1, -0.3}, {1.6, 0.3}, [](double, double) { return 2.7; });
  const NavigabilityGrid grid = rasterize(map);
  EXPECT_EQ(test::at(grid, 0.025, 0.025).navigability, 1.0F);
  EXPECT_EQ(test::at(grid, 1.325, 0.025).navigability, 0.0F) << "below it and not connected";
}

/// A random map of everything, and random changes to it.
class Changing {
 public:
  PlanarMap map;
  RasterChanges changes;

  Changing() {
    test::add_path(map, {-3, 0, 0}, {-2, 0, 0});
    test::add_floor(
        map, {-4, -2}, {4, 2}, [](double x, double) { return x > 2 ? 0.12 : 0.0; }, 0.004);
    test::add_wall(map, {-3, 1.5}, {3, 1.7}, 0, 2);
    test::add_plate(map, {-5, -3}, {5, 3}, 0, true);
    add_ring(map, 0.7);
    for (int k = 0; k < 50; ++k) map.loose_points.push_back(place());
    for (Surfel& s : map.surfels) s.parent_plane = 1;
  }
  void change() {
    changes = {};
    for (int k = 0; k < 5; ++k) {
      const std::size_t s = pick(map.surfels.size()), p = pick(map.loose_points.size());
      map.surfels[s].center += Eigen::Vector3d(0.1 * number(), 0.1 * number(), 0.02 * number());
      map.surfels[s].parent_plane = k % 2;  // a wall is nobody's parent: their own slopes count
      map.loose_points[p] = place();
      changes.surfels.push_back(s);
      changes.loose_points.push_back(p);
    }
    const std::size_t e = pick(map.edges.size());
    map.edges[e].position_map += Eigen::Vector3d(0.2 * number(), 0.2 * number(), 0);
    changes.edges.push_back(e);
    for (auto& v : map.planes[0].outlines_map[0]) v.x() += 0.1 * number();
    const Eigen::Vector3d n = Eigen::Vector3d(0.1 * number(), 0.1 * number(), 1).normalized();
    map.planes[1].plane_map = Plane(n, 0);
    changes.planes = {0, 1};
    test::add_wall(map, place().head<2>(), place().head<2>(), 0, 0.5);
    map.edges.resize(map.edges.size() - 3);
    std::erase_if(changes.edges, [this](std::size_t k) { return k >= map.edges.size(); });
    map.surfels.push_back(test::surfel_at(4 * number(), 2 * number(), 0, {0, 0, 1}, 0.003));
    const Eigen::Vector3d last = map.trajectory.back().pose.translation();
    test::add_path(map, last, last + Eigen::Vector3d(0.6, 0, 0));
  }

 private:
  double number() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  std::size_t pick(std::size_t n) { return random_() % n; }
  Eigen::Vector3d place() { return {4 * number(), 2 * number(), 0.4 + 0.4 * number()}; }
  std::mt19937 random_{7};
};

TEST(RasterUpdate, EqualsAMapDrawnFromScratch) {
  Changing world;
  Rasterizer finds, observed;
  finds.update(world.map);
  observed.update(world.map);
  const std::size_t all = finds.tiles_drawn();
  for (int k = 0; k < 6; ++k) {
    world.change();
    finds.update(world.map);
    observed.update(world.map, world.changes);
    const NavigabilityGrid scratch = rasterize(world.map);
    EXPECT_GT(known_bounds(scratch).width, 100);
    EXPECT_EQ(differences(finds.grid(), scratch), 0) << k;
    EXPECT_EQ(differences(observed.grid(), scratch), 0) << k;
  }
  finds.update(world.map);
  EXPECT_EQ(finds.tiles_drawn(), 0u) << "nothing changed";
  world.map.loose_points[3].z() += 0.01;
  finds.update(world.map);
  EXPECT_LE(finds.tiles_drawn(), 4u);
  EXPECT_GT(all, 20u);
}

TEST(RasterUpdate, FollowsWhenALoopCloses) {
  Changing world;
  Rasterizer rasterizer;
  rasterizer.update(world.map);
  const SE3 T_new_old(SO3::rot_z(0.02), {0.31, -0.17, 0.01});
  PlanarMap moved;
  for (const Surfel& s : world.map.surfels) moved.surfels.push_back(s.transformed(T_new_old));
  for (EdgePoint e : world.map.edges) {
    e.position_map = T_new_old * e.position_map;
    moved.edges.push_back(e);
  }
  for (const auto& pose : world.map.trajectory) {
    moved.trajectory.add(pose.stamp, T_new_old * pose.pose);
  }
  rasterizer.update(moved);
  EXPECT_EQ(differences(rasterizer.grid(), rasterize(moved)), 0);
  rasterizer.update(PlanarMap{});
  EXPECT_TRUE(known_bounds(rasterizer.grid()).empty());
}

TEST(RasterUpdate, AnUpdateEndsBetweenTwoTiles) {
  PlanarMap map;
  test::add_path(map, {-2, 0, 0}, {2, 0, 0});
  test::add_floor(map, {-4, -4}, {4, 4}, [](double, double) { return 0.0; });
  struct Ended {};
  int calls = 0, allowed = 1 << 20;
  const auto update = [&] {
    Rasterizer rasterizer{RasterOptions{}};
    rasterizer.before_each_tile([&] {
      if (++calls > allowed) throw Ended();
    });
    rasterizer.update(map);
    return rasterizer.tiles_drawn();
  };
  const std::size_t tiles = update();
  const int all = calls;
  EXPECT_GT(all, static_cast<int>(tiles));
  for (allowed = 0; allowed < all; ++allowed) {
    calls = 0;
    EXPECT_THROW(update(), Ended) << allowed;
  }
}

}  // namespace
}  // namespace lamina
