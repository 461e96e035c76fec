// Floor behind the rim of a table is not called free where nobody looked through above it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <lamina/grid/evidence/overhangs.hpp>

#include "pipeline/box_hall.hpp"

namespace lamina {
namespace {

const Box kTop{{1.8, -0.5, 0.68}, {2.6, 0.5, 0.72}};  // of a table
const Box kBar{{1.8, -0.5, 0.68}, {1.84, 0.5, 0.72}};
const Box kWall{{1.8, -0.8, 0}, {1.9, 0.8, 2}};

// A hall with a wall at x = 5, a camera at 0.6 m that looks along x, a little down. Tops and
// undersides return nothing.
struct Drive {
  Looks looks;
  std::vector<KeptScan> scans;
  std::vector<SolidCell> rim;  // at x = 1.8

  Drive() {
    for (int j = -10; j < 10; ++j) rim.push_back({{36, j}, 0, 0.7, 0.72});
  }
  void see(int images, const Box& box, double x) {
    looks.add(BoxHall{{box}, true}.image(x, 0.2), x, images);
    if (x < 1.8) scan(box);
  }
  // Of the last image: beams that end at the rim, which squares of looks are too large to tell.
  void scan(const Box& box) {
    KeptScan kept;
    kept.from_depth = true;
    kept.scan.stamp = looks.path.back().stamp;
    kept.scan.angle_min = -0.4;
    kept.scan.angle_increment = 0.01;
    const double ahead = box.low.x() + 0.02 - looks.path.back().pose.translation().x();
    for (int k = -40; k <= 40; ++k) {
      kept.scan.ranges.push_back(static_cast<float>(ahead / std::cos(0.01 * k)));
    }
    scans.push_back(kept);
  }
  std::vector<CellIndex> hidden(const std::vector<SolidCell>& solid) const {
    return hidden_behind(solid, looks.votes.seen(), looks.path, 0.05, [this](const auto& take) {
      for (const KeptScan& kept : scans) take(kept);
    });
  }
  bool hidden(double x, double y) const {
    const auto cells = hidden(rim);
    return std::count(cells.begin(), cells.end(), cell_of({x, y}, 0.05)) > 0;
  }
};

TEST(Overhangs, WhatATopHidesBehindItsRimIsUnknown) {
  Drive drive;
  drive.see(3, kTop, 0);
  for (const double x : {1.87, 2.12, 2.57}) {
    EXPECT_TRUE(drive.hidden(x, 0.02)) << x;
    EXPECT_TRUE(drive.hidden(x, 0.32)) << x;
  }
  EXPECT_FALSE(drive.hidden(1.72, 0.02));  // before it
  EXPECT_FALSE(drive.hidden(3.02, 0.02));  // no top is that deep
  EXPECT_FALSE(drive.hidden(2.12, 0.9));   // beside it
}

TEST(Overhangs, TheNextRimEndsATop) {
  Drive drive;
  for (int j = -10; j < 10; ++j) drive.rim.push_back({{51, j}, 0, 0.7, 0.72});
  drive.see(3, kTop, 0);
  EXPECT_TRUE(drive.hidden(2.52, 0.02));
  EXPECT_FALSE(drive.hidden(2.67, 0.02));
}

TEST(Overhangs, LooksThatWentThroughFreeWhatABarHid) {
  Drive drive;
  drive.see(3, kBar, 0);
  EXPECT_TRUE(drive.hidden(2.72, 0.32));
  drive.see(2, kBar, 1.9);
  EXPECT_TRUE(drive.hidden(2.72, 0.32));  // two say too little
  drive.see(1, kBar, 1.9);
  EXPECT_FALSE(drive.hidden(2.72, 0.32));
}

TEST(Overhangs, WhereTheRobotPassedNothingHangs) {
  Drive drive;
  drive.see(3, kBar, 0);
  EXPECT_TRUE(drive.hidden(2.12, 0.02));
  drive.looks.path.add(Timestamp::from_nanoseconds(10'000'000'000),
                       SE3::from_translation({2.12, 0, 0}));
  EXPECT_FALSE(drive.hidden(2.12, 0.02));
  EXPECT_TRUE(drive.hidden(2.12, 0.32));
}

TEST(Overhangs, WallsHideNothingThatWasSeenFromBeforeThem) {
  Drive drive;
  drive.see(3, kWall, 0);
  EXPECT_TRUE(drive.hidden(drive.rim).empty());
}

// Outlines are squares of 0.1 m: the plane of an edge of 4 cm stands in two of them.
TEST(Overhangs, ARimMadeOfAPlaneIsARim) {
  Drive drive;
  for (SolidCell& cell : drive.rim) {
    cell.low = 0.6;
    cell.high = 0.8;
  }
  drive.see(3, kTop, 0);
  EXPECT_TRUE(drive.hidden(2.12, 0.02));
  for (SolidCell& cell : drive.rim) cell.low = 0.4;  // the face of a cupboard
  EXPECT_TRUE(drive.hidden(drive.rim).empty());
}

TEST(Overhangs, FewPointsAndThingsOnTheFloorAreNoRims) {
  Drive drive;
  drive.see(3, kTop, 0);
  std::vector<SolidCell> few(drive.rim.begin(), drive.rim.begin() + 3), low = drive.rim;
  EXPECT_TRUE(drive.hidden(few).empty());
  for (SolidCell& cell : low) cell.low = 0.05;
  EXPECT_TRUE(drive.hidden(low).empty());
}

TEST(Overhangs, HiddenCellsLoseTheirVerdictAndKeepTheirHeight) {
  NavigabilityGrid grid(0.05);
  grid.at_or_new({1, 1}) = {0.01F, 0, 1, 0.99F};
  grid.at_or_new({2, 1}) = {0.7F, 0, 0, 0.95F};
  hide(grid, {{1, 1}, {2, 1}, {3, 1}});
  EXPECT_FALSE(grid.find({1, 1})->known());
  EXPECT_EQ(grid.find({1, 1})->height, 0.01F);
  EXPECT_EQ(grid.find({2, 1})->navigability, 0);
  EXPECT_EQ(grid.find({2, 1})->confidence, 0.95F);
}

}  // namespace
}  // namespace lamina
