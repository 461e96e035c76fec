// Worlds, cameras and scanners at random through the front-ends, as fuzz/fuzz_frontends.cpp draws
// them for longer.
#include <gmock/gmock.h>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/sim/sim_recording.hpp>

#include "support/frontend_draws.hpp"

namespace lamina {
namespace {

constexpr double kLongestStep = 1;  // s
constexpr std::uint64_t kEach = 6;

class FrontendDraws : public testing::TestWithParam<std::uint64_t> {
 protected:
  template <class Draw>
  void all(const Draw& draw) {
    for (std::uint64_t k = 0; k < kEach; ++k) {
      const std::uint64_t seed = kEach * GetParam() + k;
      Draws draws(seed);
      const DrawResult result = draw(draws);
      EXPECT_EQ(result.broken, "") << "seed " << seed;
      EXPECT_LT(result.longest_step_s, kLongestStep) << "seed " << seed;
    }
  }
};

TEST_P(FrontendDraws, ImagesEnd) { all(draw_images); }

TEST_P(FrontendDraws, ScansEnd) { all(draw_scans); }

INSTANTIATE_TEST_SUITE_P(Seeds, FrontendDraws, testing::Range<std::uint64_t>(0, 25));

// From 0.28 m the rims of stairs that go down come nearer from line to line than they are far.
TEST(FrontendDraws, StairsSeenFromKneeHeight) {
  sim::Simulation simulation(sim::make_scene("stairs_down", {{"camera.height_m", "0.28"},
                                                             {"camera.pitch_deg", "0"},
                                                             {"camera.width", "320"},
                                                             {"camera.height", "240"},
                                                             {"stairs.distance_m", "3"}}),
                             1);
  FloorFrontend frontend;
  ObstacleScanner scanner;
  while (const auto measurement = simulation.next()) {
    const auto* frame = std::get_if<DepthFrame>(&*measurement);
    if (!frame) continue;
    const ObstacleScan scan = scanner.process(*frame, frontend.process(*frame));
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (scan.cause[i] != BeamCause::kNone) {
        EXPECT_GE(scan.range[i], 0);
      }
    }
    break;
  }
}

}  // namespace
}  // namespace lamina
