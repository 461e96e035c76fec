// Floor between legs whose ends no image shows is not called free.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <lamina/grid/evidence/legs.hpp>

#include "pipeline/box_hall.hpp"

namespace lamina {
namespace {

constexpr double kRobotHeight = 0.75;

// Four legs of a table of 0.8 x 0.6 m in a hall, a camera at 0.6 m that looks along x.
struct Table {
  double length;  // of its legs, m
  double seen;    // height that the grid has them to, m
  std::vector<Box> boxes;
  std::vector<SolidCell> solid;
  Looks looks;

  Table(double leg_length, double seen_to) : length(leg_length), seen(seen_to) {
    for (const double x : {1.8, 2.6}) {
      for (const double y : {-0.3, 0.3}) leg(x, y);
    }
  }
  void leg(double x, double y) {
    boxes.push_back({{x - 0.02, y - 0.02, 0}, {x + 0.02, y + 0.02, length}});
    const CellIndex cell = cell_of({x, y}, 0.05);
    solid.push_back({cell, 0, 0.05, seen});
    solid.push_back({{cell.i + 1, cell.j}, 0, 0.1, seen - 0.1});
  }
  void see(double x, double pitch, int images) {
    looks.add(BoxHall{boxes}.image(x, pitch), x, images);
  }
  std::vector<CellIndex> hidden() const {
    return between_legs(solid, looks.votes.seen(), looks.path, 0.05, kRobotHeight);
  }
  bool hidden(double x, double y) const {
    const auto cells = hidden();
    return std::count(cells.begin(), cells.end(), cell_of({x, y}, 0.05)) > 0;
  }
};

constexpr double kDown = 0.7, kAhead = 0;  // rad: a view that ends below the camera, and above

TEST(Legs, WhatLegsCarryAboveTheViewIsUnknown) {
  Table table(0.7, 0.4);
  table.see(0.8, kDown, 3);
  for (const double y : {-0.27, 0.02, 0.27}) {
    EXPECT_TRUE(table.hidden(1.87, y)) << y;
    EXPECT_TRUE(table.hidden(2.22, y)) << y;
    EXPECT_TRUE(table.hidden(2.57, y)) << y;
  }
  EXPECT_FALSE(table.hidden(1.67, 0.02));  // before it
  EXPECT_FALSE(table.hidden(2.77, 0.02));  // behind it
  EXPECT_FALSE(table.hidden(2.22, 0.47));  // beside it
}

TEST(Legs, PostsThatWereSeenToEndCarryNothing) {
  Table table(0.3, 0.3);
  table.see(0.8, kDown, 3);
  EXPECT_TRUE(table.hidden(2.22, 0.02));
  table.see(0, kAhead, 2);
  EXPECT_TRUE(table.hidden(2.22, 0.02));  // two looks say too little
  table.see(0, kAhead, 1);
  EXPECT_TRUE(table.hidden().empty());
}

TEST(Legs, LegsSeenToTheRobotsHeightHideNothing) {
  Table table(1, 0.74);
  table.see(0.8, kDown, 3);
  EXPECT_TRUE(table.hidden().empty());
}

TEST(Legs, TwoLegsCarryWhatHangsAboveThem) {
  Table table(0.7, 0.4);
  table.solid.resize(4);  // the legs at x = 1.8
  table.see(0.8, kDown, 3);
  EXPECT_TRUE(table.hidden().empty());  // posts beside a way
  const CellIndex far = cell_of({2.6, -0.3}, 0.05);
  for (int j = 0; j < 12; ++j) table.solid.push_back({{far.i, far.j + j}, 0, 0.55, 0.7});
  EXPECT_TRUE(table.hidden(2.22, 0.02));
  for (SolidCell& cell : table.solid) {
    if (cell.cell.i == far.i) cell.low = 0;  // the face of a box
  }
  EXPECT_TRUE(table.hidden().empty());
}

TEST(Legs, ThingsFurtherApartAreNotLegsOfOneTable) {
  Table table(0.7, 0.4);
  for (std::size_t k = 4; k < table.solid.size(); ++k) table.solid[k].cell.i += 12;
  table.see(0.8, kDown, 3);
  EXPECT_TRUE(table.hidden().empty());
}

TEST(Legs, WhereTheRobotPassedNothingHangs) {
  Table table(0.7, 0.4);
  table.see(0.8, kDown, 3);
  table.looks.path.add(Timestamp::from_nanoseconds(10'000'000'000),
                       SE3::from_translation({2.2, 0, 0}));
  EXPECT_FALSE(table.hidden(2.22, 0.02));
  EXPECT_TRUE(table.hidden(2.22, 0.22));
}

}  // namespace
}  // namespace lamina
