// Edges of the graph, clearance, and paths round what is in the way.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <lamina/grid/clearance.hpp>
#include <lamina/grid/occupancy_fill.hpp>
#include <lamina/grid/planner.hpp>
#include <lamina/grid/rasterizer.hpp>
#include <lamina/grid/traversability.hpp>
#include <lamina/models/error.hpp>

#include "grid/terrain.hpp"

namespace lamina {
namespace {

// '.' free, '#' blocked, ' ' unknown, digits: height in cm; first line at the largest y; 0.1 m.
NavigabilityGrid drawn(const std::vector<std::string>& lines) {
  NavigabilityGrid grid(0.1);
  for (std::size_t row = 0; row < lines.size(); ++row) {
    for (std::size_t i = 0; i < lines[row].size(); ++i) {
      const char what = lines[row][i];
      if (what == ' ') continue;
      const float height = what >= '0' && what <= '9' ? 0.01F * static_cast<float>(what - '0') : 0;
      grid.at_or_new({static_cast<int>(i), static_cast<int>(lines.size() - 1 - row)}) = {
          height, 0, what == '#' ? 0.0F : 1.0F, 1};
    }
  }
  return grid;
}

TEST(Traversability, EdgesAreStepsOfAtMostT) {
  const NavigabilityGrid grid = drawn({"0123", "0002"});
  const TraversabilityGraph graph(grid, 0.01);
  EXPECT_TRUE(graph.edge({0, 1}, {1, 1}));
  EXPECT_TRUE(graph.edge({1, 1}, {1, 0}));
  EXPECT_FALSE(graph.edge({2, 1}, {2, 0})) << "2 cm";
  EXPECT_FALSE(graph.edge({0, 1}, {2, 1})) << "not neighbours";
  EXPECT_FALSE(graph.edge({0, 1}, {0, 1}));
  EXPECT_FALSE(graph.edge({0, 1}, {-1, 1})) << "outside";
  int degree = 0;
  graph.for_each_neighbour({0, 0}, [&degree](const CellIndex&) { ++degree; });
  EXPECT_EQ(degree, 3);
}

TEST(Traversability, CornersAreNotCut) {
  const NavigabilityGrid grid = drawn({".#", ".."});
  const TraversabilityGraph graph(grid, 0.02);
  EXPECT_TRUE(graph.edge({0, 1}, {0, 0}));
  EXPECT_TRUE(graph.edge({0, 0}, {1, 0}));
  EXPECT_FALSE(graph.edge({0, 1}, {1, 0}));
  const NavigabilityGrid ridge = drawn({"05", "00"});
  EXPECT_FALSE(TraversabilityGraph(ridge, 0.02).edge({0, 1}, {1, 0})) << "nor over a raised corner";
}

TEST(Clearance, EqualsBruteForce) {
  const std::vector<std::string> lines{".........", "..#......", ".........", "......  .",
                                       "........."};
  const NavigabilityGrid grid = drawn(lines);
  const GridGeometry g = known_bounds(grid);
  const std::vector<float> image = clearance_image(grid, g);
  for (int j = 0; j < g.height; ++j) {
    for (int i = 0; i < g.width; ++i) {
      double nearest = 1e9;
      for (int v = -1; v <= g.height; ++v) {
        for (int u = -1; u <= g.width; ++u) {
          const NavigabilityCell* c = grid.find({u, v});
          if (c != nullptr && c->navigability > 0) continue;
          nearest = std::min(nearest, 0.1 * std::hypot(u - i, v - j));
        }
      }
      EXPECT_NEAR(image[g.image_index({i, j})], nearest, 1e-6) << i << " " << j;
    }
  }
}

PlannerOptions small_robot() {
  PlannerOptions options;
  options.robot_radius = 0.05;
  options.clear_weight = 0;
  return options;
}

TEST(Planner, TheShortestPathOnAnOpenFloorIsTheOctileOne) {
  const NavigabilityGrid grid = drawn(std::vector<std::string>(30, std::string(40, '.')));
  const Plan plan = plan_path(grid, {0.25, 0.25}, {3.25, 1.25}, small_robot());
  ASSERT_EQ(plan.status, PlanStatus::kFound) << plan.reason;
  EXPECT_NEAR(plan.length, 1.0 * std::sqrt(2.0) + 2.0, 1e-9);
  EXPECT_EQ(plan.path_map.front(), Eigen::Vector2d(0.25, 0.25));
  EXPECT_EQ(plan.path_map.back(), Eigen::Vector2d(3.25, 1.25));
}

// Dijkstra written down plainly, on a maze.
TEST(Planner, EqualsRelaxationToTheEnd) {
  std::vector<std::string> lines(20, std::string(20, '.'));
  for (int k = 0; k < 17; ++k) lines[6][static_cast<std::size_t>(k)] = '#';
  for (int k = 3; k < 20; ++k) lines[12][static_cast<std::size_t>(k)] = '#';
  const NavigabilityGrid grid = drawn(lines);
  const TraversabilityGraph graph(grid, 0.02);
  const auto inside = [](const CellIndex& c) {
    return c.i > 0 && c.j > 0 && c.i < 19 && c.j < 19;  // half a cell from what is not known
  };
  std::vector<double> d(400, 1e9);
  d[static_cast<std::size_t>(2 * 20 + 2)] = 0;
  for (int round = 0; round < 100; ++round) {
    for (int k = 0; k < 400; ++k) {
      const CellIndex c{k % 20, k / 20};
      if (!inside(c)) continue;
      graph.for_each_neighbour(c, [&](const CellIndex& n) {
        if (!inside(n)) return;
        auto& there = d[static_cast<std::size_t>(n.j * 20 + n.i)];
        there = std::min(there,
                         d[static_cast<std::size_t>(k)] + 0.1 * std::hypot(n.i - c.i, n.j - c.j));
      });
    }
  }
  PlannerOptions options = small_robot();
  options.robot_radius = 0.04;
  const Plan plan = plan_path(grid, {0.25, 0.25}, {1.75, 1.75}, options);
  ASSERT_EQ(plan.status, PlanStatus::kFound) << plan.reason;
  EXPECT_NEAR(plan.length, d[static_cast<std::size_t>(17 * 20 + 17)], 1e-9);
}

TEST(Planner, KeepsTheRobotsRadiusAndLikesMore) {
  std::vector<std::string> lines(40, std::string(60, '.'));
  for (int row = 10; row < 30; ++row)
    lines[static_cast<std::size_t>(row)].replace(25, 10, "##########");
  const NavigabilityGrid grid = drawn(lines);
  const GridGeometry g = known_bounds(grid);
  const std::vector<float> clearance = clearance_image(grid, g);
  const auto least = [&](double weight) {
    PlannerOptions options;
    options.clear_weight = weight;
    const Plan plan = plan_path(grid, {1.05, 2.05}, {5.05, 2.05}, options);
    EXPECT_EQ(plan.status, PlanStatus::kFound) << plan.reason;
    float d = 1e9F;
    for (const auto& p : plan.path_map) d = std::min(d, clearance[g.image_index(cell_of(p, 0.1))]);
    return d;
  };
  EXPECT_GE(least(0), 0.25F);
  EXPECT_GT(least(10), least(0));
}

TEST(Planner, SaysWhereItIsBlocked) {
  std::vector<std::string> lines(20, std::string(30, '.'));
  for (auto& line : lines) line[15] = '#';
  lines[3][3] = '#';
  const NavigabilityGrid grid = drawn(lines);
  const PlannerOptions options = small_robot();
  const Plan no_way = plan_path(grid, {0.55, 0.55}, {2.55, 0.55}, options);
  EXPECT_EQ(no_way.status, PlanStatus::kNoWay);
  ASSERT_TRUE(no_way.nearest_map.has_value());
  EXPECT_NEAR(no_way.nearest_map->x(), 1.45, 1e-9);
  EXPECT_EQ(no_way.reason,
            "no way: what can be reached from the start ends at 1.45, 0.55, 1.10 m from the goal");
  EXPECT_TRUE(no_way.path_map.empty());
  EXPECT_EQ(plan_path(grid, {1.55, 0.55}, {2.55, 0.55}, options).status, PlanStatus::kStartNotFree);
  EXPECT_EQ(plan_path(grid, {0.55, 0.55}, {9.0, 0.5}, options).reason,
            "goal (9.00, 0.50) is unknown: the map has not seen it");
  EXPECT_EQ(plan_path(grid, {0.55, 0.55}, {1.55, 0.55}, options).reason,
            "goal (1.55, 0.55) is not free: navigability is 0 there");
  PlannerOptions wrong;
  wrong.max_step = 0;
  EXPECT_THROW(plan_path(grid, {0, 0}, {1, 1}, wrong), Error);
}

TEST(Planner, BeginsBesideAnUnseenStart) {
  const NavigabilityGrid grid = drawn(std::vector<std::string>(20, "     ..............."));
  const Plan plan = plan_path(grid, {0.25, 1.05}, {1.55, 1.05});
  ASSERT_EQ(plan.status, PlanStatus::kFound) << plan.reason;
  EXPECT_EQ(plan.path_map.front(), Eigen::Vector2d(0.25, 1.05));
  EXPECT_EQ(plan_path(grid, {-2.0, 1.05}, {1.55, 1.05}).status, PlanStatus::kStartNotFree);
}

TEST(Planner, GoesRoundAHole) {
  PlanarMap map;
  test::add_path(map, {-1.5, 0, 0}, {-1, 0, 0});
  test::add_floor(map, {-2, -2}, {2, 2}, [](double, double) { return 0.0; });
  const auto in_hole = [](double x, double y) { return std::abs(x) < 0.5 && std::abs(y) < 0.8; };
  std::erase_if(map.surfels, [&](const Surfel& s) { return in_hole(s.center.x(), s.center.y()); });
  const NavigabilityGrid grid = rasterize(map);
  const Plan plan = plan_path(grid, {-1.5, 0.0}, {1.5, 0.0});
  ASSERT_EQ(plan.status, PlanStatus::kFound) << plan.reason;
  for (const auto& p : plan.path_map) {
    const double outside =
        std::hypot(std::max(std::abs(p.x()) - 0.5, 0.0), std::max(std::abs(p.y()) - 0.8, 0.0));
    EXPECT_GE(outside, 0.25) << p.transpose();
  }
}

TEST(OccupancyFill, AScannersFreeSpaceIsHalfBelieved) {
  OccupancyGrid scans;
  for (int k = 0; k < 6; ++k) {
    std::vector<OccupancyBeam> beams;
    for (double y = -1; y <= 1; y += 0.005) beams.push_back({{2.0, y}, 0.005, true});
    scans.add(SE3(SO3(), {0, 0, 0.3}), beams);
  }
  NavigabilityGrid grid;
  grid.at_or_new(cell_of({1.0, 0.0}, 0.05)) = {0, 0, 0, 0.9F};
  fill_from_occupancy(grid, scans);
  EXPECT_EQ(test::at(grid, 1.5, 0.0).navigability, 1.0F);
  EXPECT_LE(test::at(grid, 1.5, 0.0).confidence, 0.5F);
  EXPECT_TRUE(std::isnan(test::at(grid, 1.5, 0.0).height));
  EXPECT_EQ(test::at(grid, 2.01, 0.01).navigability, 0.0F);
  EXPECT_EQ(test::at(grid, 1.0, 0.0).navigability, 0.0F) << "what was known stays";
  EXPECT_FALSE(test::at(grid, 2.5, 0.0).known());
  EXPECT_TRUE(TraversabilityGraph(grid, 0.02)
                  .edge(cell_of({1.51, 0.01}, 0.05), cell_of({1.56, 0.01}, 0.05)));
}

TEST(OccupancyFill, ReturnsThatMostRaysWentThroughAreTakenBackAtTheScannersHeight) {
  OccupancyGrid scans;
  for (int k = 0; k < 12; ++k) {
    std::vector<OccupancyBeam> beams;
    for (double y = -1; y <= 1; y += 0.005) beams.push_back({{2.0, y}, 0.005, true});
    if (k == 0) beams.push_back({{1.0, 0.0}, 0.005, true});  // the jamb and what is behind, mixed
    scans.add(SE3(SO3(), {0, 0, 0.3}), beams);
  }
  const std::vector<Eigen::Vector3d> points = {
      {1.0, 0.0, 0.3}, {2.01, 0.01, 0.3}, {1.0, 0.0, 0.1}, {5.0, 0.0, 0.3}};
  const auto kept = without_passed(points, scans, 0.2, 0.4);
  ASSERT_EQ(kept.size(), 3u) << "only the first was looked through";
  EXPECT_EQ(kept[0], points[1]);
  EXPECT_EQ(kept[1], points[2]) << "a low box that no ray touches stays";
  EXPECT_EQ(kept[2], points[3]);
  // Heights are over what is under a point: where that is lower, the low box is looked through.
  const auto higher = without_passed(
      points, scans, 0.2, 0.4, {}, [](const Eigen::Vector3d& p) { return p.z() < 0.2 ? -0.2 : 0; });
  EXPECT_EQ(higher.size(), 2u);
  const auto unknown = without_passed(points, scans, 0.2, 0.4, {}, [](const Eigen::Vector3d&) {
    return std::numeric_limits<double>::quiet_NaN();
  });
  EXPECT_EQ(unknown.size(), 4u);
}

}  // namespace
}  // namespace lamina
