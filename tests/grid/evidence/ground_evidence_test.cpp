// Low things and missing floor over many images: kept, outvoted, spread.
#include <gtest/gtest.h>

#include <lamina/grid/evidence/ground_evidence.hpp>

namespace lamina {
namespace {

Timestamp at(int k) { return Timestamp::from_nanoseconds(std::int64_t{k} * 100'000'000); }

struct Drive {
  GroundVotes votes;
  PlanarMap map;
  int k = 0;

  /// From x, floor everywhere but about a mark at (2, 0) of the map; height 0: none.
  void look(double x, double height) {
    GroundLook look;
    look.origin = {0, -1};
    look.nx = 80;
    look.ny = 40;
    look.floor_bits.assign(80 * 40 / 8, 0);
    for (int i = 0; i < look.nx; ++i) {
      for (int j = 0; j < look.ny; ++j) {
        const Eigen::Vector2d c(0.05 * i + 0.025 + x - 2, 0.05 * j - 0.975);
        if (height == 0 || c.cwiseAbs().maxCoeff() > 0.2) look.set_floor(i, j);
      }
    }
    if (height != 0) {
      look.marks.push_back(
          {{static_cast<float>(2.02 - x), 0.02F}, static_cast<float>(height), 0.002F});
    }
    votes.add(at(k), look, SE3());
    map.trajectory.add(at(k++), SE3::from_translation({x, 0, 0}));
  }
  PlanarMap result() const {
    PlanarMap found = map;
    votes.put_into(found, map.trajectory, 0.05, 0.02);
    return found;
  }
};

TEST(GroundVotes, WhatThreeImagesShowStandsInTheMap) {
  Drive drive;
  for (int k = 0; k < 2; ++k) drive.look(0.5 + 0.1 * k, 0.03);
  EXPECT_TRUE(drive.result().loose_points.empty());  // may be noise
  drive.look(0.7, 0.03);
  const PlanarMap map = drive.result();
  ASSERT_EQ(map.loose_points.size(), 2u);
  EXPECT_LT((map.loose_points[0] - Eigen::Vector3d(2.02, 0.02, 0.03)).norm(), 1e-6);
  EXPECT_LT((map.loose_points[1] - Eigen::Vector3d(2.02, 0.02, 0.015)).norm(), 1e-6);
  EXPECT_TRUE(map.edges.empty());
}

TEST(GroundVotes, LooksFromAsNearThatSeeFloorTakeItBack) {
  Drive drive;
  for (int k = 0; k < 4; ++k) drive.look(0.5, 0.03);
  for (int k = 0; k < 3; ++k) drive.look(0.5, 0);
  EXPECT_EQ(drive.result().loose_points.size(), 2u);
  drive.look(0.5, 0);
  EXPECT_TRUE(drive.result().loose_points.empty());
}

TEST(GroundVotes, LooksFromFarDoNot) {
  Drive drive;
  for (int k = 0; k < 3; ++k) drive.look(1.2, 0.03);
  for (int k = 0; k < 20; ++k) drive.look(0, 0);
  EXPECT_EQ(drive.result().loose_points.size(), 2u);
}

TEST(GroundVotes, FloorThatIsNotThereIsAnEndOfKnowledge) {
  Drive drive;
  for (int k = 0; k < 3; ++k) drive.look(0.5, -0.3);
  const PlanarMap map = drive.result();
  EXPECT_TRUE(map.loose_points.empty());
  // The place, and those within two cells that nobody saw as floor either.
  EXPECT_EQ(map.edges.size(), 25u);
  for (const EdgePoint& edge : map.edges) {
    EXPECT_FALSE(edge.negative);
    EXPECT_LT((edge.position_map - Eigen::Vector3d(2.02, 0.02, 0)).cwiseAbs().maxCoeff(), 0.13);
  }
}

TEST(GroundVotes, WhatTheRobotStepsOverStaysOut) {
  Drive drive;
  for (int k = 0; k < 3; ++k) drive.look(0.5, -0.015);
  EXPECT_TRUE(drive.result().edges.empty());
}

TEST(GroundVotes, GoThroughSessions) {
  Drive drive;
  for (int k = 0; k < 3; ++k) drive.look(0.5, 0.03);
  std::vector<SeenGround> seen(1);
  seen[0].stamp = at(0);
  seen[0].look.nx = seen[0].look.ny = 8;
  seen[0].look.marks = {{{1, 0}, 0.05F, 0.001F}};
  drive.votes.take(seen);
  EXPECT_EQ(drive.votes.seen().size(), 1u);
}

}  // namespace
}  // namespace lamina
