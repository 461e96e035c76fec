// What a coarse depth image says of places.
#include <gtest/gtest.h>

#include <lamina/models/depth_look.hpp>

namespace lamina {
namespace {

// 40 x 30 squares that all reach `depth`; looks along z.
DepthLook wall_at(double depth) {
  DepthLook look;
  look.fx = look.fy = 33;
  look.cx = 20;
  look.cy = 15;
  look.pixel = 1 / 267.0F;
  look.noise = 1.4e-3F;
  look.nx = 40;
  look.ny = 30;
  look.reach.assign(40 * 30, DepthLook::code(depth));
  return look;
}

TEST(DepthLook, CodesAreDepthsRoundedDown) {
  for (double z = DepthLook::kNearest; z < 38; z *= 1.0031) {
    const double coded = DepthLook::depth(DepthLook::code(z));
    EXPECT_LE(coded, z * (1 + 1e-7));
    EXPECT_GT(coded, z / 1.0201);
  }
  EXPECT_EQ(DepthLook::code(0.2), 0);
  EXPECT_EQ(DepthLook::depth(0), 0);
  EXPECT_EQ(DepthLook::code(std::numeric_limits<double>::quiet_NaN()), 0);
  EXPECT_LT(DepthLook::depth(DepthLook::code(1e6)), 39);
}

TEST(DepthLook, APlaceIsMetOrPassedOrHidden) {
  const DepthLook look = wall_at(3);
  EXPECT_EQ(look.at({0.1, 0.2, 3}, 0.06), Sight::kMet);
  EXPECT_EQ(look.at({0.1, 0.2, 2.9}, 0.06), Sight::kMet);
  EXPECT_EQ(look.at({0.1, 0.2, 2.5}, 0.06), Sight::kPast);
  EXPECT_EQ(look.at({0.1, 0.2, 3.5}, 0.06), Sight::kUnknown);
  EXPECT_EQ(look.at({0, 0, -2}, 0.06), Sight::kUnknown);
  EXPECT_EQ(look.at({5, 0, 2}, 0.06), Sight::kUnknown);
}

TEST(DepthLook, AllLinesOfSightAboutAPlaceMustGoPast) {
  DepthLook look = wall_at(3);
  const std::size_t square = 15 * 40 + 20;  // of the optical axis
  look.reach[square] = 0;                   // nothing came back
  EXPECT_EQ(look.at({0.02, 0.02, 2}, 0.06), Sight::kUnknown);
  look.reach[square] = DepthLook::code(2);  // a pole
  EXPECT_EQ(look.at({0.02, 0.02, 2}, 0.06), Sight::kMet);
  look.reach[square] = DepthLook::code(1);  // something before it
  EXPECT_EQ(look.at({0.02, 0.02, 2}, 0.06), Sight::kUnknown);
}

TEST(DepthLook, AtTheImagesBorderAPlaceIsMetButNotPassed) {
  const double x = 2 * (40 - 20 - 0.5) / 33;  // half a square inside
  EXPECT_EQ(wall_at(2).at({x, 0, 2}, 0.06), Sight::kMet);
  EXPECT_EQ(wall_at(3).at({x, 0, 2}, 0.06), Sight::kUnknown);
}

}  // namespace
}  // namespace lamina
