// Wheels of a wrong scale, beside motions by scans and in a corridor that tells little of the way.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include <lamina/models/skipped.hpp>
#include <lamina/pipeline/calibration/report.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

// A straight drive, 0.1 m a step; what scans are off at one step they are not at the next.
struct Drive {
  std::mt19937 rng;
  std::normal_distribution<double> normal{0, 1};
  OdometryModel model;
  WheelScale scale{model};
  double scans_off = 0, seconds = 1000;

  explicit Drive(unsigned seed) : rng(seed) {}
  Timestamp next_stamp() { return Timestamp::from_seconds(seconds += 0.2); }
  void go(int steps, double wheels_are, double noise_share = 0.5) {
    for (int i = 0; i < steps; ++i) {
      const SE3 observed = SE3::planar(0.1 * wheels_are, 0, 0);
      const double sigma = noise_share * std::sqrt(increment_covariance(model, observed)(0, 0));
      const double off = 0.005 * normal(rng);
      scale.add(next_stamp(), SE3::planar(0.1 * wheels_are + sigma * normal(rng), 0, 0),
                SE3::planar(0.1 + off - scans_off, 0, 0));
      scans_off = off;
    }
  }
};

TEST(WheelScale, IsToldToAThird) {
  Drive drive(1);
  drive.go(1000, 1.02);
  const auto found = drive.scale.found();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, 1 / 1.02 - 1, 3 * found->sigma);
  EXPECT_LT(found->sigma, 0.003);
  EXPECT_TRUE(found->adoption.adopted);
}

// A bare corridor of which scans tell half: its wheels' error passed for a third of what it is.
TEST(WheelScale, ALargeOneIsToldByAShortWay) {
  Drive drive(2);
  drive.go(220, 1.05);
  const auto found = drive.scale.found();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, 1 / 1.05 - 1, 3 * found->sigma);
  EXPECT_TRUE(found->adoption.adopted);
}

TEST(WheelScale, IsBeyondTheNoiseOfAMetre) {
  OdometryModel model;
  model.sigma_translation = 0.02;
  const WheelScale scale(model);
  EXPECT_TRUE(scale.beyond_noise({-0.03, 0.001, 100, {}}));
  EXPECT_FALSE(scale.beyond_noise({-0.015, 0.001, 100, {}}));
}

TEST(WheelScale, OfRightWheelsIsNotAdopted) {
  int adopted = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    Drive drive(100 + seed);
    drive.go(std::array{200, 450, 1000}[seed % 3], 1, 1);
    const auto found = drive.scale.found();
    ASSERT_TRUE(found);
    adopted += found->adoption.adopted;
  }
  EXPECT_LE(adopted, 1);
}

// Of odometry a third short, too, a tenth that slips and a tenth that counts backwards as forwards.
TEST(WheelScale, IsThatOfMostPieces) {
  Drive drive(3);
  for (int i = 0; i < 10; ++i) {
    drive.go(120, 0.7, 0.1);
    drive.go(15, 1.2, 0.1);
    for (int k = 0; k < 15; ++k) {
      drive.scale.add(drive.next_stamp(), SE3::planar(0.07, 0, 0), SE3::planar(-0.1, 0, 0));
    }
  }
  const auto found = drive.scale.found();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, 1 / 0.7 - 1, 0.02);
}

TEST(WheelScale, NeedsAWay) {
  Drive drive(4);
  for (int i = 0; i < 1000; ++i) {
    drive.scale.add(drive.next_stamp(), SE3::planar(0.1, 0, 0), std::nullopt);
    drive.scale.add(drive.next_stamp(), SE3::planar(0, 0, 0.1), SE3::planar(0, 0, 0.1));
  }
  EXPECT_FALSE(drive.scale.found());
  drive.go(120, 1.1);
  EXPECT_TRUE(drive.scale.found() && !drive.scale.found()->adoption.adopted);
  EXPECT_FALSE(drive.scale.has_enough());
  drive.go(1500, 1.1);
  EXPECT_TRUE(drive.scale.has_enough());
}

std::vector<testing::Wall> corridor_with_niches(double length) {
  constexpr double kEvery = 4, kWide = 0.95, kDeep = 0.18, kHalf = 1.2;
  std::vector<testing::Wall> walls;
  for (const double side : {-1.0, 1.0}) {
    const double y = side * kHalf, in = side * (kHalf + kDeep);
    double from = -5;
    for (double x = side; x < length; x += kEvery) {
      walls.push_back({{from, y}, {x, y}});
      walls.push_back({{x, y}, {x, in}});
      walls.push_back({{x, in}, {x + kWide, in}});
      walls.push_back({{x + kWide, in}, {x + kWide, y}});
      from = x + kWide;
    }
    walls.push_back({{from, y}, {length + 5, y}});
  }
  return walls;
}

// Down the corridor, by wheels that count `wheels_are` times the way.
class Corridor final : public Recording {
 public:
  Corridor(double wheels_are, bool wheels, bool camera = false)
      : wheels_are_(wheels_are), wheels_(wheels) {
    if (camera) calibration_.depth_camera.emplace();
    scanner_.beams = 301;
    scanner_.fov = 2 * M_PI;
    scanner_.range_max = 8;
  }
  std::optional<Measurement> next() override {
    const int i = given_ / 2;
    if (i == kScans) return std::nullopt;
    const bool odometry = given_++ % 2 == 0;
    const double x = kStep * i;
    const Timestamp stamp = Timestamp::from_seconds(1000 + 0.2 * i);
    if (odometry && !wheels_) return Accelerometer{stamp};
    if (odometry) return Odometry{stamp, SE3::planar(wheels_are_ * x, 0, 0)};
    return scanner_.scan(walls_, SE3::planar(x, 0, 0), stamp.seconds());
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }
  int scans_given() const { return given_ / 2; }
  static constexpr double kStep = 0.15;  // m a scan

 private:
  static constexpr int kScans = 300;
  double wheels_are_;
  bool wheels_;
  int given_ = 0;
  testing::Scanner scanner_;
  std::vector<testing::Wall> walls_ = corridor_with_niches(kScans * kStep);
  Calibration calibration_;
};

const auto kOn = [] { return false; };

std::optional<WheelScale::Found> scale_in_corridor(double wheels_are, bool camera = false) {
  Corridor recording(wheels_are, true, camera);
  const FrontEnd observed({}, recording.calibration());
  return find_wheel_scale(recording, {}, observed, kOn);
}

// Matched with the wheels' own word of the way, scans repeat much of it.
TEST(FindWheelScale, ACorridorTellsIt) {
  const auto found = scale_in_corridor(1.03);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, 1 / 1.03 - 1, 0.005);
  Diagnostics metrics;
  EXPECT_TRUE(tell_wheel_scale(*found, true, metrics));
  EXPECT_TRUE(metrics.calibration.front().adopted);
  EXPECT_EQ(metrics.counts.wheel_scale_correction, found->scale);
}

// What the camera and walls met again do not hold.
TEST(FindWheelScale, BesideACameraALargeOneIsTakenOut) {
  ASSERT_TRUE(scale_in_corridor(1.03, true));
  EXPECT_TRUE(scale_in_corridor(1.03, true)->adoption.adopted);
  EXPECT_FALSE(scale_in_corridor(1.012, true));
}

TEST(FindWheelScale, WithoutTheLookWheelsLeadScans) {
  Corridor recording(1.03, true);
  FrontEnd front_end({}, recording.calibration());
  WheelScale scale(recording.calibration().odometry);
  Diagnostics metrics;
  while (const auto measurement = recording.next()) {
    const auto step = front_end.process(*measurement, metrics);
    if (step)
      scale.add(step->observations.stamp, step->wheels_moved, step->scan_motion->by_scans_alone);
  }
  ASSERT_TRUE(scale.found());
  EXPECT_GT(scale.found()->scale, 0.8 * (1 / 1.03 - 1));
}

TEST(FindWheelScale, RightWheelsStayAsTheyAre) {
  EXPECT_FALSE(scale_in_corridor(1)->adoption.adopted);
}

// A third short is no radius: said, and not corrected.
TEST(FindWheelScale, BeyondItsBoundItIsAWarning) {
  const WheelScale::Found found{0.3, 0.01, 50, {12, 100, 3, true}, 1};
  Diagnostics metrics;
  EXPECT_FALSE(tell_wheel_scale(found, true, metrics));
  ASSERT_EQ(metrics.warnings.size(), 1);
  EXPECT_EQ(metrics.warnings[0].id, "wheel_scale");
}

// Ranges that are 8 % too long look the same: corrected, and both causes said.
TEST(FindWheelScale, BeyondFourPriorSigmasItsTwoCausesAreSaid) {
  Diagnostics metrics;
  EXPECT_TRUE(tell_wheel_scale({0.08, 0.002, 50, {12, 100, 3, true}, 1}, true, metrics));
  ASSERT_EQ(metrics.warnings.size(), 1);
  EXPECT_EQ(metrics.warnings[0].id, "wheel_scale");
  EXPECT_NE(metrics.warnings[0].text.find("ranges"), std::string::npos);
  Diagnostics usual;
  EXPECT_TRUE(tell_wheel_scale({0.05, 0.002, 50, {12, 100, 3, true}, 1}, true, usual));
  EXPECT_TRUE(usual.warnings.empty());
}

// m; of wheels that count 3 % too much.
double first_motion(const std::optional<WheelScale::Found>& known) {
  Corridor recording(1.03, true);
  FrontEnd front_end({}, recording.calibration());
  if (known) front_end.motion().wheels().begin(known->scale, known->sigma);
  Diagnostics metrics;
  std::optional<Step> step;
  for (int i = 0; i < 4; ++i) step = front_end.process(*recording.next(), metrics);
  EXPECT_DOUBLE_EQ(step->wheels_moved->translation().x(), 1.03 * Corridor::kStep);
  return step->motion.T_from_to.translation().x();
}

TEST(FindWheelScale, TheFirstMotionIsCorrected) {
  const WheelScale::Found known{1 / 1.03 - 1, 0.001, 100, {}, 1};
  EXPECT_LT(first_motion(known), first_motion(std::nullopt) - 0.001);
}

TEST(FindWheelScale, WithoutWheelsTheLookEnds) {
  Corridor recording(1, false);
  const FrontEnd observed({}, recording.calibration());
  EXPECT_FALSE(find_wheel_scale(recording, {}, observed, kOn));
  EXPECT_LE(recording.scans_given(), 101);
}

}  // namespace
}  // namespace lamina
