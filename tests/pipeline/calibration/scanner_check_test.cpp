// What a scanner's description has wrong, by pairs of scans and the wheels' motion between them.
#include <gtest/gtest.h>

#include <algorithm>

#include <lamina/pipeline/calibration/scanner_check.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::Scanner;

// Round and round in the middle of the room.
SE3 turning(int i) {
  return SE3::planar(0.3 * std::cos(0.1 * i), 0.3 * std::sin(0.1 * i), 0.1 * i + M_PI / 2);
}

// A drive through the room; `spoil` is done to each scan before it is given.
template <class Spoil>
ScannerCheck driven(const Spoil& spoil, double wheel_turns = 1, SE3 (*pose)(int) = testing::drive,
                    std::size_t most_pairs = 12) {
  Scanner scanner;
  scanner.beams = 181;
  scanner.fov = M_PI;
  scanner.T_body_lidar = SE3::planar(0.2, 0, 0);
  ScannerCheckOptions options;
  options.most_pairs = most_pairs;
  ScannerCheck check(options);
  SE3 last;
  for (int i = 0; i < 160 && check.wants_more(); ++i) {
    const SE3 T = pose(i);
    LaserScan scan = scanner.scan(testing::room(), T, 0.1 * i);
    spoil(scan);
    PlanarPose moved = planar_part(last.inverse() * T);
    moved.yaw *= wheel_turns;
    check.add(scan, i > 0 ? std::optional(lifted(moved)) : std::nullopt);
    last = T;
  }
  return check;
}

TEST(ScannerCheck, LeavesARightScannerAlone) {
  EXPECT_FALSE(driven([](LaserScan&) {}).found());
  EXPECT_FALSE(driven([](LaserScan&) {}, 1.08).found());  // wheels of a wrong track
}

TEST(ScannerCheck, FindsBeamsThatRunTheOtherWay) {
  const auto found =
      driven([](LaserScan& s) { std::reverse(s.ranges.begin(), s.ranges.end()); }).found();
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->correction.mirrored);
  EXPECT_EQ(found->correction.yaw, 0);
  EXPECT_EQ(found->correction.aperture, 1);
  EXPECT_LT(found->cost, 0.2 * found->cost_stated);
}

TEST(ScannerCheck, AnIncrementOfTheWrongSignIsAMirrorImageTurned) {
  const auto found = driven([](LaserScan& s) {
                       s.angle_min = -0.5;  // the fan's middle is no longer ahead
                       s.angle_increment = -s.angle_increment;
                     }).found();
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->correction.mirrored);
  LaserScan scan;
  scan.ranges.resize(181, 1.0F);
  scan.angle_min = -0.5;
  scan.angle_increment = -M_PI / 180;
  found->correction.apply(scan);
  const double first = scan.angle_min + scan.lidar.T_body_lidar.so3().yaw();
  EXPECT_NEAR(wrap_angle(first + M_PI / 2), 0, 0.1);
}

TEST(ScannerCheck, FindsAScannerThatFacesElsewhere) {
  for (const double yaw : {M_PI, M_PI / 2, -1.0}) {
    const auto found = driven([yaw](LaserScan& s) {
                         s.lidar.T_body_lidar = SE3(SO3::rot_z(yaw) * s.lidar.T_body_lidar.so3(),
                                                    s.lidar.T_body_lidar.translation());
                       }).found();
    ASSERT_TRUE(found) << yaw;
    EXPECT_FALSE(found->correction.mirrored);
    EXPECT_NEAR(wrap_angle(found->correction.yaw + yaw), 0, 0.05) << yaw;
  }
}

TEST(ScannerCheck, FindsAScannerThatSitsElsewhere) {
  const auto found = driven(
                         [](LaserScan& s) {
                           s.lidar.T_body_lidar = SE3::planar(-0.4, 0.5, 0);  // it is at 0.2, 0
                         },
                         1, turning, 30)
                         .found();
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->correction.mirrored);
  EXPECT_EQ(found->correction.yaw, 0);
  EXPECT_NEAR(found->correction.place.x(), 0.6, 0.05);
  EXPECT_NEAR(found->correction.place.y(), -0.5, 0.05);
  const SE3 T = found->correction.apply(SE3::planar(-0.4, 0.5, 0));
  EXPECT_NEAR(T.translation().x(), 0.2, 0.05);
}

// The fan is said to be so many times as wide as it is.
auto opened(double times) {
  return [times](LaserScan& s) {
    s.angle_min *= times;
    s.angle_increment *= times;
  };
}

TEST(ScannerCheck, FindsTheApertureUnderWhichScansTurnAsWheelsDo) {
  for (const double stated : {0.5, 1.5}) {
    const auto found = driven(opened(stated), 1, turning).found();
    ASSERT_TRUE(found) << stated;
    EXPECT_FALSE(found->correction.mirrored);
    EXPECT_NEAR(found->correction.aperture * stated, 1, 0.03) << stated;
  }
}

// Wheels, too, may be off by a few per cent: it is how well scans fit each other that decides.
TEST(ScannerCheck, FindsApertureErrorsThatWheelsMayHaveToo) {
  for (const double stated : {0.94, 1.05}) {
    const auto found = driven(opened(stated), 1.02).found();
    ASSERT_TRUE(found) << stated;
    EXPECT_NEAR(found->correction.aperture * stated, 1, 0.02) << stated;
  }
}

// Wheels that turn by another amount: the scans fit no better with another aperture.
TEST(ScannerCheck, WheelsOfAWrongTrackAreNoAperture) {
  for (const double turns : {1.4, 0.95, 1.05}) {
    const auto found = driven([](LaserScan&) {}, turns, turning).found();
    EXPECT_FALSE(found && found->correction.aperture != 1) << turns;
  }
}

// Ranges that are too long by a decimetre leave no hypothesis that explains all.
TEST(ScannerCheck, AMirrorImageIsFoundBesideAnotherFault) {
  const auto found = driven([](LaserScan& s) {
                       std::reverse(s.ranges.begin(), s.ranges.end());
                       for (float& range : s.ranges) range += 0.15F;
                     }).found();
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->correction.mirrored);
}

// The order changes in the middle of the drive, or for the middle of it: after the first pairs.
TEST(ScannerCheck, FindsWhereTheOrderOfBeamsChanges) {
  for (const int until : {1000, 110}) {
    int i = 0;
    const auto reverse = [&](LaserScan& scan) {
      const bool reversed = i >= 60 && i < until;
      ++i;
      if (reversed) std::reverse(scan.ranges.begin(), scan.ranges.end());
    };
    const auto found = driven(reverse, 1, turning, 30).found();
    ASSERT_TRUE(found) << until;
    ASSERT_FALSE(found->changes.empty()) << until;
    EXPECT_FALSE(found->correction.mirrored);
    const std::size_t changes = until == 1000 ? 1 : 2;
    ASSERT_EQ(found->changes.size(), changes);
    EXPECT_LE(found->changes[0].from.seconds(), 6.0);
    EXPECT_GE(found->changes[0].to.seconds(), 5.9);
    ASSERT_EQ(found->correction.reversed.size(), 1);
    EXPECT_FALSE(found->correction.is_mirrored(Timestamp::from_seconds(1)));
    EXPECT_TRUE(found->correction.is_mirrored(Timestamp::from_seconds(8.5)));
    EXPECT_EQ(found->correction.is_mirrored(Timestamp::from_seconds(15.5)), changes == 1);
  }
}

// A board at 0.6 m before a third of the fan does not hide that beams run the other way.
TEST(ScannerCheck, LeavesOutWhatComesAlongFirst) {
  const auto found = driven(
                         [](LaserScan& s) {
                           std::reverse(s.ranges.begin(), s.ranges.end());
                           std::fill(s.ranges.begin() + 20, s.ranges.begin() + 80, 0.6F);
                         },
                         1, turning, 40)
                         .found();
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->correction.mirrored);
  ASSERT_EQ(found->correction.own.size(), 181);
  LaserScan scan;
  scan.ranges.resize(181, 0.6F);
  found->correction.apply(scan);
  EXPECT_TRUE(scan.valid(10));
  EXPECT_FALSE(scan.valid(50));
}

TEST(ScannerCheck, TwoScansInTurnShowThatTheirOrderChanges) {
  Scanner scanner;
  LaserScan one = scanner.scan(testing::room(), testing::drive(20), 1);
  LaserScan next = scanner.scan(testing::room(), testing::drive(21), 1.1);
  EXPECT_LT(ScannerCheck::reversal(one, next), -0.02);
  std::reverse(next.ranges.begin(), next.ranges.end());
  EXPECT_GT(ScannerCheck::reversal(one, next), 0.02);
}

TEST(ScannerCheck, WithoutTurnsNothingIsSaid) {
  ScannerCheck check;
  Scanner scanner;
  for (int i = 0; i < 40; ++i) {
    LaserScan scan = scanner.scan(testing::corridor(), SE3::planar(0.1 * i, 0, 0), 0.1 * i);
    std::reverse(scan.ranges.begin(), scan.ranges.end());
    check.add(scan, SE3::planar(i > 0 ? 0.1 : 0, 0, 0));
  }
  EXPECT_FALSE(check.found());
}

}  // namespace
}  // namespace lamina
