// Labels of quarters on literal labels of pixels.
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include <lamina/frontend/depth/quarter_labels.hpp>

namespace lamina {
namespace {

constexpr int kColumns = 6, kRows = 4, kBlock = 8;  // blocks

struct Drawn {
  DisparityImage image;
  BlockImage blocks;
  std::vector<std::uint8_t> marks;
  std::vector<std::int16_t> block_labels;

  QuarterLabels quarters() const { return quarter_labels(image, blocks, block_labels, marks); }
};

// `mark(u, v)`: region + 1; `measured(u, v)`: whether there is a disparity.
Drawn drawn(
    const std::function<int(int, int)>& mark,
    const std::function<bool(int, int)>& measured = [](int, int) { return true; }) {
  Drawn d;
  d.image.width = kColumns * kBlock;
  d.image.height = kRows * kBlock;
  d.blocks.size = kBlock;
  d.blocks.columns = kColumns;
  d.blocks.rows = kRows;
  d.blocks.blocks.resize(kColumns * kRows);
  d.block_labels.assign(kColumns * kRows, -1);
  for (int v = 0; v < d.image.height; ++v) {
    for (int u = 0; u < d.image.width; ++u) {
      d.image.d.push_back(measured(u, v) ? 20.0F : 0.0F);
      d.marks.push_back(static_cast<std::uint8_t>(measured(u, v) ? mark(u, v) : 0));
    }
  }
  for (int b = 0; b < kColumns * kRows; ++b) {
    std::map<int, int> count;
    for (int v = b / kColumns * kBlock; v < (b / kColumns + 1) * kBlock; ++v) {
      for (int u = b % kColumns * kBlock; u < (b % kColumns + 1) * kBlock; ++u) {
        ++count[d.marks[static_cast<std::size_t>(v * d.image.width + u)]];
      }
    }
    for (const auto& [label, n] : count) {
      if (label > 0 && 2 * n >= kBlock * kBlock) {
        d.block_labels[static_cast<std::size_t>(b)] = static_cast<std::int16_t>(label - 1);
      }
    }
  }
  return d;
}

TEST(QuarterLabels, ABorderWithinABlockIsFoundToAQuarter) {
  for (const int border : {17, 19, 20, 21, 23}) {
    const QuarterLabels q = drawn([&](int u, int) { return u < border ? 1 : 2; }).quarters();
    ASSERT_EQ(q.columns, 2 * kColumns);
    for (int c = 0; c < q.columns; ++c) {
      for (int r = 0; r < q.rows; ++r) {
        if (q.first_px(c + 1) <= border) {
          EXPECT_EQ(q.at(c, r), 0) << border << " " << c;
        }
        if (q.first_px(c) >= border) {
          EXPECT_EQ(q.at(c, r), 1) << border << " " << c;
        }
      }
    }
  }
}

TEST(QuarterLabels, AnImageThatLacksPixelsKeepsItsPlanes) {
  const Drawn d = drawn([](int, int) { return 1; }, [](int u, int v) { return (u + v) % 2 == 0; });
  for (const std::int16_t label : d.quarters().labels) EXPECT_EQ(label, 0);
}

TEST(QuarterLabels, WhatIsNotMeasuredIsNoPlane) {
  const Drawn d = drawn([](int, int) { return 1; }, [](int u, int) { return u < 20; });
  const QuarterLabels q = d.quarters();
  for (int r = 0; r < q.rows; ++r) {
    EXPECT_EQ(q.at(4, r), 0);
    EXPECT_EQ(q.at(5, r), -1);
  }
}

TEST(QuarterLabels, ImagesMayEndWithinABlock) {
  const int width = kColumns * kBlock - 6;  // the last block is two pixels wide
  Drawn cut = drawn([](int, int) { return 1; });
  cut.image.width = width;
  cut.image.d.assign(static_cast<std::size_t>(width * cut.image.height), 20.0F);
  cut.marks.assign(cut.image.d.size(), 1);
  cut.block_labels[kColumns - 1] = -1;  // so that its quarters are looked at
  const QuarterLabels q = cut.quarters();
  EXPECT_EQ(q.at(q.columns - 2, 0), 0);
  EXPECT_EQ(q.at(q.columns - 1, 0), -1);  // no pixel
  EXPECT_EQ(q.at(q.columns - 3, 0), 0);
}

TEST(QuarterLabels, NothingLabelledGivesNothing) {
  EXPECT_TRUE(quarter_labels({}, {}, {}, {}).labels.empty());
}

TEST(QuarterLabels, AStripAQuarterWideAtTheFootOfAWallGoes) {
  // A wall to the left, whose lowest rows go on along the floor.
  QuarterLabels q = drawn([](int u, int v) {
                      return u < 24 ? 1 : v >= 16 && v < 21 ? 1 : 2;
                    }).quarters();
  ASSERT_EQ(q.at(9, 4), 0);
  prune_thin_borders(q);
  EXPECT_EQ(q.at(9, 4), -1);
  EXPECT_EQ(q.at(5, 4), 0);
  EXPECT_EQ(q.at(9, 6), 1);
}

TEST(QuarterLabels, AFaceAQuarterWideStays) {
  QuarterLabels q = drawn([](int, int v) { return v >= 16 && v < 20 ? 2 : 1; }).quarters();
  prune_thin_borders(q);
  for (int c = 0; c < q.columns; ++c) EXPECT_EQ(q.at(c, 4), 1);
}

// A wall 1 m to the side: its far end is seen in quarters that span metres.
TEST(QuarterLabels, TheFarEndOfAWallSeenAtAGrazingAngleIsNotToldByQuarters) {
  DisparityGeometry g;
  g.fx = g.fy = 100;
  g.focal_baseline = 10;
  g.cx = -36;
  g.cy = 16;
  QuarterLabels q = drawn([](int, int) { return 1; }).quarters();
  ExtractedPlane wall;
  wall.slope = M_PI / 2;
  // x = 1 m: u = fx / Z, d = F / Z = u F / fx.
  wall.disparity = {g.focal_baseline / g.fx, 0, 0};
  const std::vector<ExtractedPlane> planes{wall};
  drop_coarse(q, planes, g);
  for (int c = 0; c < q.columns; ++c) {
    const double depth = g.fx / (q.first_px(c) + 1.5 - g.cx);
    const double span = 4 * depth * depth / g.fx + 4 * depth / g.fx;
    EXPECT_EQ(q.at(c, 4), span > 0.3 ? -1 : 0) << c << " " << span;
  }
  EXPECT_EQ(q.at(0, 4), -1);
}

TEST(QuarterLabels, APlaneThatIsFarAsAWholeStays) {
  DisparityGeometry g;
  g.fx = g.fy = 60;
  g.focal_baseline = 6;
  QuarterLabels q = drawn([](int, int) { return 1; }).quarters();
  const QuarterLabels before = q;
  ExtractedPlane wall;
  wall.slope = M_PI / 2;
  wall.disparity = {0, 0, 0.3};  // 20 m away
  const std::vector<ExtractedPlane> planes{wall};
  drop_coarse(q, planes, g);
  EXPECT_EQ(q.labels, before.labels);
}

}  // namespace
}  // namespace lamina
