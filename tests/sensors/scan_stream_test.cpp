// What all scans of a recording say together, and the angles of lines that state none.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/sensors/readers/carmen_log.hpp>
#include <lamina/sensors/scan_stream.hpp>

namespace lamina {
namespace {

Timestamp at(double seconds) { return Timestamp::from_seconds(seconds); }

// A room of some 4 by 8 m with noise, seen while the robot drives; every tenth beam has no return.
std::vector<float> scan_of(int k, double code, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 0.01);
  std::vector<float> ranges;
  for (int i = 0; i < 180; ++i) {
    const double a = (i - 89.5) * M_PI / 180;
    const double wall = std::min(2 / std::max(1e-3, std::abs(std::sin(a))),
                                 (8 - 0.02 * k) / std::max(1e-3, std::cos(a)));
    ranges.push_back(static_cast<float>(i % 10 == 0 ? code : wall + noise(random)));
  }
  return ranges;
}

NoReturnCode room(double code, int scans = 100) {
  std::mt19937 random(1);
  NoReturnCode returns;
  for (int k = 0; k < scans; ++k) returns.add(scan_of(k, code, random));
  return returns;
}

TEST(NoReturnCode, IsAPeakBeyondAllWalls) {
  for (const double code : {9.99, 12.0, 51.15, 81.83}) {
    const auto found = room(code).code();
    ASSERT_TRUE(found) << code;
    EXPECT_LE(*found, static_cast<float>(code));
    EXPECT_GT(*found, code - 0.03);
  }
  EXPECT_FALSE(room(HUGE_VAL).code());
  EXPECT_FALSE(room(0).code());
}

TEST(NoReturnCode, MayBeScattered) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> scatter(51.14, 51.16);
  NoReturnCode returns;
  for (int k = 0; k < 100; ++k) {
    auto ranges = scan_of(k, 0, random);
    for (std::size_t i = 0; i < ranges.size(); i += 10) {
      ranges[i] = static_cast<float>(scatter(random));
    }
    if (k == 50) ranges[0] = 51.25f;
    returns.add(ranges);
  }
  ASSERT_TRUE(returns.code());
  EXPECT_NEAR(*returns.code(), 51.14, 0.011);
  EXPECT_EQ(returns.warning(*returns.code(), 0).id, "no_return_code");
}

// SICK's codes in centimetres: 8183 to 8191.
TEST(NoReturnCode, MayBeSeveralRangesNearEachOther) {
  std::mt19937 random(6);
  NoReturnCode returns;
  for (int k = 0; k < 100; ++k) {
    auto ranges = scan_of(k, 0, random);
    for (std::size_t i = 0; i < ranges.size(); i += 10) {
      const float codes[] = {81.83f, 81.87f, 81.91f};
      ranges[i] = codes[random() % 3];
    }
    returns.add(ranges);
  }
  ASSERT_TRUE(returns.code());
  EXPECT_NEAR(*returns.code(), 81.83, 0.011);
}

// Codes as one old SICK wrote them: nearly all 51.15, a few as much as 5 cm nearer.
TEST(NoReturnCode, ReachesDownToItsRareNeighbours) {
  std::mt19937 random(7);
  NoReturnCode returns;
  for (int k = 0; k < 200; ++k) {
    auto ranges = scan_of(k, 51.15, random);
    if (k % 2 == 0) ranges[10] = 51.14f;
    if (k % 4 == 0) ranges[20] = 51.10f;
    returns.add(ranges);
  }
  ASSERT_TRUE(returns.code());
  EXPECT_NEAR(*returns.code(), 51.10, 0.011);
}

// The far wall of a room in which the robot stands is where most returns are, and goes on beyond.
TEST(NoReturnCode, AWallIsNone) {
  std::mt19937 random(3);
  NoReturnCode standing;
  for (int k = 0; k < 100; ++k) standing.add(scan_of(0, 0, random));
  EXPECT_FALSE(standing.code());
}

TEST(ScanStream, ScansPublishedTwiceAreUsedOnce) {
  std::mt19937 random(4);
  ScanStream stream;
  for (int k = 0; k < 100; ++k) {
    const auto ranges = scan_of(k, 0, random);
    stream.add(at(0.1 * k), ranges, 0, 30);
    stream.add(at(0.1 * k + 0.001), ranges, 0, 30);
  }
  stream.finish([](std::size_t k) { return "scan " + std::to_string(k); });
  EXPECT_EQ(stream.stamp(20), at(1.0));
  EXPECT_FALSE(stream.stamp(21));
  ASSERT_EQ(stream.notes().warnings.size(), 1u);
  EXPECT_EQ(stream.notes().warnings[0].id, "scans_repeated");
  EXPECT_NE(stream.notes().warnings[0].text.find("first at scan 1:"), std::string::npos);
}

TEST(ScanStream, ASweepIsNoLongerThanTheIntervalOfScans) {
  for (const double sweep : {0.1, 0.3}) {
    std::mt19937 random(7);
    ScanStream stream;
    for (int k = 0; k < 50; ++k) stream.add(at(0.1 * k), scan_of(k, 0, random), 0, 30, sweep);
    stream.finish([](std::size_t k) { return std::to_string(k); });
    EXPECT_EQ(stream.sweep_can_be(sweep), sweep < 0.2);
    EXPECT_EQ(stream.notes().warnings.size(), sweep < 0.2 ? 0u : 1u);
  }
}

// Every fifth comes after the next: transport, not the clock.
TEST(ScanStream, ScansThatCameLateKeepTheirStamps) {
  for (const double set_back : {0.0, 0.53}) {
    std::mt19937 random(9);
    ScanStream stream;
    std::vector<double> stamps;
    for (int k = 0; k < 100; ++k) stamps.push_back(0.1 * k - (k > 50 ? set_back : 0));
    for (std::size_t k = 5; set_back == 0 && k < 99; k += 5) std::swap(stamps[k], stamps[k + 1]);
    for (const double stamp : stamps) stream.add(at(stamp), scan_of(0, 0, random), 0, 30);
    stream.finish([](std::size_t k) { return std::to_string(k); }, true);
    EXPECT_EQ(stream.stamp(10) == at(stamps[10]) && stream.stamp(60) == at(stamps[60]),
              set_back == 0);
  }
}

TEST(ScanStream, RangesInMillimetresOrCentimetresBecomeMetres) {
  for (const float unit : {1.F, 100.F, 1000.F}) {
    std::mt19937 random(8);
    ScanStream stream;
    LaserScan scan;
    for (int k = 0; k < 50; ++k) {
      scan.ranges = scan_of(k, 0, random);
      for (float& range : scan.ranges) range *= unit;
      scan.range_max = 12 * static_cast<double>(unit);
      stream.add(at(0.1 * k), scan.ranges, 0, scan.range_max);
    }
    stream.finish([](std::size_t k) { return std::to_string(k); });
    stream.correct(scan);
    EXPECT_NEAR(scan.range_max, 12, 1e-6);
    EXPECT_LT(scan.ranges[90], 10);
    EXPECT_EQ(stream.notes().warnings.size(), unit == 1 ? 0u : 1u);
  }
}

TEST(ScanStream, BurstsKeepTheirRecordedStampsAside) {
  std::mt19937 random(5);
  ScanStream stream;
  for (int k = 0; k < 100; ++k) {
    const double stamp = k >= 40 && k < 55 ? 5.5 - 0.004 * (55 - k) : 0.1 * k;
    stream.add(at(stamp), scan_of(k, 0, random), 0, 30);
  }
  stream.finish([](std::size_t k) { return std::to_string(k); });
  EXPECT_NEAR(*stream.stamp(45) - at(4.5), 0, 0.02);
  EXPECT_EQ(stream.restamped().at(*stream.stamp(45)), at(5.46));
  ASSERT_EQ(stream.notes().warnings.size(), 1u);
  EXPECT_EQ(stream.notes().warnings[0].id, "stamps_in_bursts");
}

TEST(CarmenAngles, AreThoseOfParamWhereTheyFit) {
  constexpr double kDegree = M_PI / 180;
  const auto near = [&](std::size_t beams, CarmenFieldOfView stated, double first, double step) {
    const auto [a, s] = carmen_angles(beams, stated);
    EXPECT_NEAR(a / kDegree, first, 1e-3) << beams;
    EXPECT_NEAR(s / kDegree, step, 1e-3) << beams;
  };
  near(421, {210, 0.5}, -105, 0.5);
  near(181, {90, 0.5}, -45, 0.5);
  near(181, {90, 0}, -45, 0.5);
  near(360, {3.14159, 0.5}, -90, 0.5);  // radians
  near(361, {}, -90, 0.5);
  near(541, {180, 0.5}, -135, 0.5);  // the field of view of another laser
}

}  // namespace
}  // namespace lamina
