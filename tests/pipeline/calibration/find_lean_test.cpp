// A first look over recordings of a scanner that leans, with and without wheels.
#include <gtest/gtest.h>

#include <lamina/pipeline/calibration/report.hpp>
#include <lamina/sim/sim_recording.hpp>

#include "frontend/segments/leaning_scan.hpp"

namespace lamina {
namespace {

using testing::kDegree;
using testing::mounted;

enum class Wheels { kNone, kStill, kTurning };

// Round and round in a room, level by its calibration.
class Turns final : public Recording {
 public:
  explicit Turns(Wheels wheels, double height = 0.2) : wheels_(wheels), height_(height) {}

  std::optional<Measurement> next() override {
    if (given_ == 2 * kScans) return std::nullopt;
    const int i = given_ / 2;
    const bool odometry = given_++ % 2 == 0;
    const SE3 T = SE3::planar(std::cos(0.1 * i), std::sin(0.1 * i), 0.1 * i);
    const Timestamp stamp = Timestamp::from_seconds(1000 + 0.1 * i);
    if (odometry && wheels_ != Wheels::kNone)
      return Odometry{stamp, wheels_ == Wheels::kStill ? SE3() : T};
    if (odometry) return Accelerometer{stamp};
    LaserScan scan =
        testing::leaning_scan(T, mounted(height_, 4 * kDegree), mounted(height_, 0), rng_);
    scan.stamp = stamp;
    return scan;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }
  int given() const { return given_; }

 private:
  static constexpr int kScans = 80;
  Wheels wheels_;
  double height_;
  int given_ = 0;
  std::mt19937 rng_{5};
  Calibration calibration_;
};

const auto kOn = [] { return false; };

TEST(FindLean, WheelsOrMatchingTellTurns) {
  for (const Wheels wheels : {Wheels::kNone, Wheels::kStill, Wheels::kTurning}) {
    Turns recording(wheels);
    Diagnostics metrics;
    const auto found = find_lean(recording, {}, metrics, kOn);
    ASSERT_TRUE(found) << static_cast<int>(wheels);
    EXPECT_NEAR(found->rotation_body.y(), 4 * kDegree, 0.1 * kDegree);
    EXPECT_NEAR(metrics.counts.scanner.turned_deg[1], 4, 0.1);
  }
}

// Walls and furniture end all beams, too. Room 1 was said to lean by 3 degrees.
TEST(FindLean, RoomsAreNoGround) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const sim::Parameters tiny{{"camera.width", "32"}, {"camera.height", "24"},
                               {"camera.fx", "26"},    {"camera.fy", "26"},
                               {"camera.cx", "15.5"},  {"camera.cy", "11.5"}};
    sim::Simulation recording(sim::make_scene("room", tiny), seed);
    Diagnostics metrics;
    EXPECT_FALSE(find_lean(recording, {}, metrics, kOn)) << seed;
  }
}

TEST(FindLean, HeightsNobodyStatedEndTheLook) {
  Turns recording(Wheels::kTurning, 0.01);
  Diagnostics metrics;
  EXPECT_FALSE(find_lean(recording, {}, metrics, kOn));
  EXPECT_EQ(recording.given(), 2);
}

TEST(FindLean, EndedEarlyNothingIsFound) {
  Turns recording(Wheels::kTurning);
  Diagnostics metrics;
  int asked = 0;
  EXPECT_FALSE(find_lean(recording, {}, metrics, [&asked] { return ++asked > 150; }));
  EXPECT_LT(recording.given(), 160);
}

}  // namespace
}  // namespace lamina
