// What comes along before a scanner, and walls that only seem to.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include <lamina/pipeline/calibration/own_returns.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::Scanner;
using Pose = std::function<SE3(int)>;

SE3 turning(int i) {
  return SE3::planar(0.3 * std::cos(0.1 * i), 0.3 * std::sin(0.1 * i), 0.1 * i + M_PI / 2);
}

// Every fourth scan of a drive, each paired with the next; `before` is what stands before the
// scanner from scan `from` on: a board of so many beams from the 40th on, at 0.5 m.
std::vector<OwnBeam> found(const std::vector<testing::Wall>& walls, const Pose& pose, int board,
                           int from = 0, const OwnReturnOptions& options = {}) {
  Scanner scanner;
  scanner.beams = 181;
  scanner.fov = M_PI;
  std::vector<LaserScan> scans;
  std::vector<SE3> poses;
  for (int i = 0; i < 120; i += 4) {
    poses.push_back(pose(i));
    scans.push_back(scanner.scan(walls, poses.back(), 0.1 * i));
    for (int beam = 40; beam < 40 + board && i >= from; ++beam)
      scans.back().ranges[static_cast<std::size_t>(beam)] =
          0.5F + 0.003F * static_cast<float>(i % 3);
  }
  std::vector<ScanPair> pairs;
  for (std::size_t i = 1; i < scans.size(); ++i)
    pairs.push_back({&scans[i - 1], &scans[i], planar_part(poses[i - 1].inverse() * poses[i])});
  return own_returns(pairs, options);
}

std::size_t beams(const std::vector<OwnBeam>& own, std::size_t from, std::size_t to) {
  std::size_t count = 0;
  for (std::size_t i = from; i < std::min(to, own.size()); ++i) count += own[i].any();
  return count;
}

TEST(OwnReturns, FindsPostsAndBoards) {
  for (const int width : {4, 40}) {
    for (const Pose& pose : {Pose(testing::drive), Pose(turning)}) {
      const auto own = found(testing::room(), pose, width);
      ASSERT_EQ(own.size(), 181) << width;
      EXPECT_EQ(beams(own, 40, 40 + static_cast<std::size_t>(width)),
                static_cast<std::size_t>(width));
      EXPECT_EQ(beams(own, 0, 40) + beams(own, 40 + static_cast<std::size_t>(width), 181), 0);
      EXPECT_TRUE(own[41].has(0.5F));
      EXPECT_FALSE(own[41].has(0.7F));
    }
  }
}

TEST(OwnReturns, FindsWhatComesAlongFromSomewhereOn) {
  EXPECT_EQ(beams(found(testing::room(), turning, 20, 60), 40, 60), 20);
}

TEST(OwnReturns, WallsThatAreDrivenAlongAreAtRest) {
  const auto along = [](int i) { return SE3::planar(0.05 * i, 0, 0); };
  EXPECT_TRUE(found(testing::corridor(), along, 0).empty());
  EXPECT_TRUE(found(testing::niches(), along, 0).empty());
  EXPECT_TRUE(found(testing::room(), testing::drive, 0).empty());
}

// A pillar that is driven around, always to the left, and a round room.
TEST(OwnReturns, WhatIsDrivenAroundIsAtRest) {
  for (const double radius : {0.2, 2.0}) {
    std::vector<testing::Wall> round;
    for (int k = 0; k < 40; ++k) {
      const auto corner = [&](int i) {
        return Eigen::Vector2d(radius * std::cos(i * M_PI / 20), radius * std::sin(i * M_PI / 20));
      };
      round.push_back({corner(k), corner(k + 1)});
    }
    const auto around = [](int i) {
      return SE3::planar(std::cos(0.05 * i), std::sin(0.05 * i), 0.05 * i + M_PI / 2);
    };
    EXPECT_TRUE(found(round, around, 0).empty()) << radius;
  }
}

// Wheels that turn the other way: nothing is met again where they say.
TEST(OwnReturns, WrongMotionsTellNothing) {
  Scanner scanner;
  scanner.beams = 181;
  scanner.fov = M_PI;
  std::vector<LaserScan> scans;
  std::vector<ScanPair> pairs;
  for (int i = 0; i < 120; i += 4) scans.push_back(scanner.scan(testing::room(), turning(i), 0));
  for (std::size_t i = 1; i < scans.size(); ++i)
    pairs.push_back({&scans[i - 1], &scans[i], {0.1, 0, -0.4}});
  EXPECT_TRUE(own_returns(pairs).empty());
}

TEST(OwnReturns, NumbersMayBeOffByAHalf) {
  const auto each = [](double OwnReturnOptions::*member) {
    for (const double k : {0.5, 1.5}) {
      OwnReturnOptions options;
      options.*member *= k;
      EXPECT_EQ(beams(found(testing::room(), turning, 10, 0, options), 40, 50), 10);
      EXPECT_TRUE(found(testing::room(), testing::drive, 0, 0, options).empty());
    }
  };
  for (const auto member :
       {&OwnReturnOptions::most_range, &OwnReturnOptions::same, &OwnReturnOptions::same_sigmas,
        &OwnReturnOptions::met, &OwnReturnOptions::off, &OwnReturnOptions::off_share,
        &OwnReturnOptions::way, &OwnReturnOptions::times_at_rest, &OwnReturnOptions::times_either})
    each(member);
}

}  // namespace
}  // namespace lamina
