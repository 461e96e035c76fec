// The test for raised and sunk ground: what it finds, and what it leaves alone.
#include <gtest/gtest.h>

#include <random>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/floor_memory.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

using namespace testing;

EvidenceGrid flat_grid(double sigma, std::uint64_t seed, double believed_sigma) {
  EvidenceGrid grid;
  grid.nx = 98;
  grid.ny = 80;
  grid.cells.resize(98 * 80);
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal(0, static_cast<float>(sigma));
  for (auto& c : grid.cells) {
    c.height = normal(random);
    c.information = static_cast<float>(1 / (believed_sigma * believed_sigma));
    c.range = 2;
  }
  return grid;
}

TEST(NormalThreshold, IsTheNormalQuantile) {
  EXPECT_NEAR(normal_threshold(0.05), 1.959964, 1e-5);
  EXPECT_NEAR(normal_threshold(0.001), 3.290527, 1e-5);
}

TEST(LowObstacles, FalseAlarmsStayAtTheSetting) {
  FloorOptions options;
  options.false_alarm = 0.05;
  options.min_obstacle_cells = 1;
  options.min_obstacle_height_m = 0;
  int alarms = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    alarms += !find_low_obstacles(flat_grid(0.004, seed, 0.004), options).empty();
  }
  EXPECT_LE(alarms, 20);  // 10 expected, neighbours being alike; 20 is three sigmas above
}

TEST(LowObstacles, ANoisierSensorThanBelievedRaisesNoAlarms) {
  int alarms = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    alarms += !find_low_obstacles(flat_grid(0.012, seed, 0.003), FloorOptions()).empty();
  }
  EXPECT_EQ(alarms, 0);
}

TEST(LowObstacles, APlateStandsOutAndATiltOfTheFloorDoesNot) {
  EvidenceGrid grid = flat_grid(0.002, 3, 0.002);
  for (int i = 0; i < grid.nx; ++i) {
    for (int j = 0; j < grid.ny; ++j) {
      CellEvidence& c = grid.cells[grid.index(i, j)];
      c.height += 0.0002F * static_cast<float>(i);  // 4 mm a metre
      if (i >= 40 && i < 44 && j >= 30 && j < 34) c.height += 0.01F;
      if (i >= 60 && i < 64 && j >= 50 && j < 54) c.height -= 0.02F;
    }
  }
  const auto found = find_low_obstacles(grid, FloorOptions());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].height, 0.01, 0.002);
  EXPECT_NEAR(found[1].height, -0.02, 0.003);
  EXPECT_LT((found[0].center_body - Eigen::Vector2d(2.1, 1.6)).norm(), 0.04);
  EXPECT_GT(found[0].probability, 0.99);
}

TEST(LowObstacles, EmptyGridsAreEmpty) {
  EXPECT_TRUE(find_low_obstacles(EvidenceGrid(), FloorOptions()).empty());
}

TEST(LowObstacles, AOneCentimetrePlateIsFoundInAFrame) {
  FloorFrontend frontend;
  const DepthFrame frame =
      draw({floor_piece(), square_piece(1.6, 0.2, 0.1, 0.01)}, test_camera(), 0.056);
  const FloorResult r = frontend.process(frame);
  ASSERT_EQ(r.low_obstacles.size(), 1u);
  EXPECT_NEAR(r.low_obstacles[0].height, 0.01, 0.0025);
  EXPECT_LT((r.low_obstacles[0].center_body - Eigen::Vector2d(1.6, 0.2)).norm(), 0.05);
}

TEST(FloorMemory, SharpensWithFramesAndForgets) {
  FloorFrontend frontend;
  FloorMemory memory;
  const SE3 T_odom_body = SE3::planar(3, -2, 0.4);
  double first = 0;
  for (int k = 0; k < 4; ++k) {
    const FloorResult r =
        frontend.process(draw({floor_piece(), square_piece(1.6, 0.2, 0.1, 0.01)}, test_camera(),
                              0.056, static_cast<std::uint64_t>(k) + 1));
    memory.add(r, T_odom_body);
    if (k == 0) {
      for (const Surfel& s : memory.surfels_odom()) first += s.sigma_height();
    }
  }
  double last = 0;
  for (const Surfel& s : memory.surfels_odom()) last += s.sigma_height();
  EXPECT_LT(last, 0.8 * first);
  const auto found = memory.low_obstacles();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT((found[0].center_body - Eigen::Vector2d(1.6, 0.2)).norm(), 0.06);
  memory.forget_beyond(0.0);
  EXPECT_EQ(memory.size(), 0u);
  EXPECT_TRUE(memory.low_obstacles().empty());
}

}  // namespace
}  // namespace lamina
