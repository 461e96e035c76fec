// Pieces of way between scans in a small world of walls.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include <lamina/pipeline/calibration/matched_pieces.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::Scanner;

// To and fro in curves through the room.
SE3 at(int i) { return SE3::planar(1.5 * std::sin(0.05 * i) - 1, 0.5, 0.8 * std::sin(0.07 * i)); }

TEST(MatchedPieces, AreNotPulledByWhatScanOdometrySays) {
  Scanner scanner;
  scanner.sigma = 0.02;
  std::deque<LaserScan> scans;
  MatchedPieces pieces;
  std::vector<SE3> ends;
  const SE3 error = SE3::planar(0.02, -0.03, 0.01);
  for (int i = 0; i < 150; ++i) {
    scans.push_back(scanner.scan(testing::room(), at(i), 0.1 * i));
    const SE3 moved = i > 0 ? at(i - 1).inverse() * at(i) : SE3();
    // Scans that say what wheels do: the place of a wrong mounting.
    const SE3 wrong = error * moved * error.inverse();
    pieces.add(scans.back(), i > 0 ? std::optional(moved) : std::nullopt, wrong);
  }
  const auto all = pieces.pieces();
  ASSERT_GT(all.size(), 10U);
  double by_wheels = 0, by_error = 0;
  for (const PairedMotion& piece : all) {
    by_wheels += (piece.scans.translation() - piece.wheels.translation()).norm();
    const SE3 wrong = error * piece.wheels * error.inverse();
    by_error += (wrong.translation() - piece.wheels.translation()).norm();
  }
  EXPECT_LT(by_wheels, 0.3 * by_error);
  EXPECT_LT(by_wheels / static_cast<double>(all.size()), 0.004);
}

TEST(MatchedPieces, BeginAnewWhereOneIsSilent) {
  Scanner scanner;
  std::deque<LaserScan> scans;
  MatchedPieces pieces;
  for (int i = 0; i < 40; ++i) {
    const SE3 T = SE3::planar(-2 + 0.1 * i, 0.5, 0), moved = SE3::planar(0.1, 0, 0);
    scans.push_back(scanner.scan(testing::room(), T, 0.1 * i));
    pieces.add(scans.back(), i % 4 == 0 ? std::nullopt : std::optional(moved), moved);
  }
  EXPECT_TRUE(pieces.pieces().empty());
}

TEST(MatchedPieces, WhatTwoScansLeaveOpenIsLeftOut) {
  Scanner scanner;
  std::deque<LaserScan> scans;
  MatchedPieces pieces;
  for (int i = 0; i < 40; ++i) {
    const SE3 moved = SE3::planar(0.1, 0, 0);
    scans.push_back(scanner.scan(testing::corridor(), SE3::planar(0.1 * i, 0, 0), 0.1 * i));
    pieces.add(scans.back(), moved, moved);
  }
  EXPECT_TRUE(pieces.pieces().empty());
}

}  // namespace
}  // namespace lamina
