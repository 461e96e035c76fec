// Rims over many frames: kept, taken back by a closer look, covered later.
#include <gtest/gtest.h>

#include <lamina/grid/evidence/negative_obstacles.hpp>

namespace lamina {
namespace {

Timestamp at(int k) { return Timestamp::from_nanoseconds(std::int64_t{k} * 100'000'000); }

// Robot at x; a rim at map x `rim` (0: none), floor seen up to map x `reach`.
ObstacleScan look(int k, double x, double rim, double reach) {
  ObstacleScan scan = ObstacleScan::empty(at(k), -0.2, 0.01, 41, 8);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double along = 1 / std::cos(scan.angle(i));
    scan.floor_range[i] = static_cast<float>((reach - x) * along);
    if (rim <= 0) continue;
    scan.cause[i] = BeamCause::kHole;
    scan.range[i] = static_cast<float>((rim - x) * along);
    scan.sigma[i] = 0.01F;
  }
  return scan;
}

struct Drive {
  RimVotes votes;
  Trajectory path;
  int k = 0;
  void see(double x, double rim, double reach) {
    votes.add(look(k, x, rim, reach), SE3());
    path.add(at(k++), SE3::from_translation({x, 0, 0}));
  }
  double nearest() const {
    double x = 1e9;
    // What the closer looks have in view.
    for (const EdgePoint& p : votes.rims(path, 0.05)) {
      if (std::abs(p.position_map.y()) < 0.12) x = std::min(x, p.position_map.x());
    }
    return x;
  }
};

TEST(RimVotes, ARimSeenAgainAndAgainStays) {
  Drive drive;
  for (int k = 0; k < 10; ++k) drive.see(0.1 * k, 2.5, 2.5);
  EXPECT_NEAR(drive.nearest(), 2.5, 0.03);
}

TEST(RimVotes, ACloserLookThatSeesFloorBeyondTakesItBack) {
  Drive drive;
  for (int k = 0; k < 5; ++k) drive.see(0.1 * k, 1.8, 1.8);
  EXPECT_NEAR(drive.nearest(), 1.8, 0.03);
  for (int k = 5; k < 10; ++k) drive.see(0.1 * k, 2.5, 2.5);
  EXPECT_NEAR(drive.nearest(), 2.5, 0.03);
}

// What may lie anywhere on half a metre blocks nothing: nobody knows.
TEST(RimVotes, ARimThatNobodyCanPlaceIsAnEndOfKnowledge) {
  for (const double sigma : {0.02, 0.15}) {
    Drive drive;
    ObstacleScan scan = look(0, 0, 2.5, 2.0);
    scan.sigma.assign(scan.size(), static_cast<float>(sigma));
    drive.votes.add(scan, SE3());
    drive.path.add(at(0), SE3());
    const auto rims = drive.votes.rims(drive.path, 0.05);
    ASSERT_FALSE(rims.empty());
    for (const EdgePoint& rim : rims) {
      EXPECT_EQ(rim.negative, sigma < 0.05);
      EXPECT_LE(rim.sigma, 0.051);
    }
  }
}

TEST(RimVotes, APlankLaidOverThePitClearsIt) {
  Drive drive;
  for (int k = 0; k < 10; ++k) drive.see(1.0, 2.0, 2.0);
  drive.see(0.5, 0, 3.5);  // one frame that missed it changes nothing
  EXPECT_NEAR(drive.nearest(), 2.0, 0.03);
  for (int k = 0; k < 3; ++k) drive.see(0.5, 0, 3.5);  // from further away, but later
  EXPECT_EQ(drive.nearest(), 1e9);
}

}  // namespace
}  // namespace lamina
