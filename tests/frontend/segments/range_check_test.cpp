// Codes, reaches and chance are known by how ranges go from beam to beam.
#include <gtest/gtest.h>

#include <lamina/frontend/segments/range_check.hpp>

#include "frontend/segments/scan_maker.hpp"

namespace lamina {
namespace {
using test::ScanMaker;

// A hall of 20 x 14 m, or polygons; `spoil` is given each scan before it counts.
template <class Spoil>
RangeCheck after_scans(const Spoil& spoil, int corners = 0) {
  ScanMaker maker;
  maker.beams = 361;
  maker.range_max = 30;
  std::mt19937 random(7);
  RangeCheck check;
  for (int k = 0; k < 50; ++k) {
    LaserScan scan = corners > 0 ? maker.scan(test::random_polygon(random, corners, 1, 12), random)
                                 : maker.scan(test::room(20, 14, 2, 1.5, 0.02 * k), random);
    spoil(scan, random);
    check.add(scan);
  }
  return check;
}

const auto kAsItIs = [](LaserScan&, std::mt19937&) {};

TEST(RangeCheck, ChanceBeyondTheReachIsFound) {
  for (const double reach : {4.0, 6.0, 8.0}) {
    const RangeCheck check = after_scans([&](LaserScan& scan, std::mt19937& random) {
      std::uniform_real_distribution<double> any(reach, 2 * reach);
      for (float& r : scan.ranges)
        if (static_cast<double>(r) > reach) r = static_cast<float>(any(random));
    });
    ASSERT_TRUE(check.noise_from().has_value()) << reach;
    EXPECT_NEAR(*check.noise_from(), reach, 0.12 * reach);
    EXPECT_FALSE(check.code().has_value());
  }
}

TEST(RangeCheck, ACodeBelowRangeMaxIsFound) {
  const RangeCheck check = after_scans([](LaserScan& scan, std::mt19937& random) {
    std::uniform_real_distribution<double> about(9.985, 9.995);
    scan.range_max = 10;
    for (float& r : scan.ranges)
      if (static_cast<double>(r) > 6) r = static_cast<float>(about(random));
  });
  ASSERT_TRUE(check.code().has_value());
  EXPECT_NEAR(*check.code(), 9.985, 0.005);
  LaserScan scan;
  scan.range_max = 10;
  EXPECT_LT(check.range_max(scan), 9.985);
  EXPECT_GT(check.range_max(scan), 9.9);
}

TEST(RangeCheck, ACodeAtRangeMaxOrAboveIsNoNews) {
  for (const float code : {10.0F, 11.0F}) {
    const RangeCheck check = after_scans([&](LaserScan& scan, std::mt19937&) {
      scan.range_max = 10;
      for (float& r : scan.ranges)
        if (r > 6) r = code;
    });
    EXPECT_FALSE(check.code() || check.reach() || check.noise_from()) << code;
  }
}

TEST(RangeCheck, ARangeMaxBelowTheRangesIsFound) {
  const RangeCheck check =
      after_scans([](LaserScan& scan, std::mt19937&) { scan.range_max = 1.5; });
  ASSERT_TRUE(check.reach().has_value());
  LaserScan scan;
  scan.range_max = 1.5;
  EXPECT_GT(check.range_max(scan), 10);
}

TEST(RangeCheck, AGoodScannerIsLeftAlone) {
  const auto far_is_none = [](LaserScan& scan, std::mt19937&) {
    for (float& r : scan.ranges)
      if (r > 6) r = 0;
  };
  for (const RangeCheck& check : {after_scans(kAsItIs), after_scans(kAsItIs, 60),
                                  after_scans(kAsItIs, 6), after_scans(far_is_none)}) {
    EXPECT_FALSE(check.code().has_value());
    EXPECT_FALSE(check.noise_from().has_value());
    EXPECT_FALSE(check.reach().has_value());
    LaserScan scan;
    scan.range_max = 30;
    EXPECT_EQ(check.range_max(scan), 30);
  }
}

}  // namespace
}  // namespace lamina
