// What one image says of the ground: small boxes, holes, plain floor.
#include <gtest/gtest.h>

#include <lamina/frontend/depth/floor_frontend.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

using namespace testing;

/// A box with its front face and top; the others cannot be seen.
std::vector<Piece> box(double x, double y, double half, double height) {
  const Piece front{Plane({-1, 0, 0}, -(x - half)), [=](const Eigen::Vector3d& p) {
                      return std::abs(p.y() - y) < half && p.z() > 0 && p.z() < height;
                    }};
  return {floor_piece(), square_piece(x, y, half, height), front};
}

GroundLook look_at(const std::vector<Piece>& pieces, std::uint64_t seed = 1) {
  FloorFrontend frontend;
  return frontend.process(draw(pieces, test_camera(), 0.056, seed)).look;
}

TEST(GroundObserver, MarksABoxTooSmallForASurfel) {
  for (const double half : {0.03, 0.05}) {
    const GroundLook look = look_at(box(1.6, 0.2, half, 0.03));
    double top = 0;
    for (const GroundMark& mark : look.marks) {
      EXPECT_LT((mark.xy - Eigen::Vector2f(1.6F, 0.2F)).norm(), half + 0.05);
      top = std::max(top, static_cast<double>(mark.height));
    }
    EXPECT_GE(look.marks.size(), 1u) << half;
    EXPECT_NEAR(top, 0.03, 0.006) << half;
    EXPECT_FALSE(look.floor_at({1.6, 0.2})) << half;
    EXPECT_TRUE(look.floor_at({1.6, -0.2})) << half;
  }
}

// Whole squares of a face end a pixel or two below its edge (13 mm a pixel here).
TEST(GroundObserver, AFaceIsAsHighAsItsEdge) {
  double sum = 0;
  int seen = 0;
  for (const double height : {0.07, 0.074, 0.078, 0.082, 0.086, 0.09}) {
    const Piece face{Plane({-1, 0, 0}, -1.6), [=](const Eigen::Vector3d& p) {
                       return std::abs(p.y()) < 0.1 && p.z() > 0 && p.z() < height;
                     }};
    FloorFrontend frontend;
    const DepthFrame frame = draw({floor_piece(), face}, small_test_camera(0.3), 0.01, 1);
    for (const GroundMark& mark : frontend.process(frame).look.marks) {
      sum += static_cast<double>(mark.height + mark.sigma) - height;
      ++seen;
    }
  }
  ASSERT_GE(seen, 12);
  EXPECT_NEAR(sum / seen, 0, 0.01);  // -0.024 as long as their middles counted
}

TEST(GroundObserver, MarksAHoleWhereTheLineOfSightPassesTheFloor) {
  Piece floor = floor_piece();
  floor.inside = [](const Eigen::Vector3d& p) {
    return std::abs(p.x() - 1.6) > 0.15 || std::abs(p.y()) > 0.15;
  };
  const Piece bottom{Plane({0, 0, 1}, -0.3)};
  const GroundLook look = look_at({floor, bottom});
  EXPECT_GE(look.marks.size(), 16u);  // of 36 cells
  for (const GroundMark& mark : look.marks) {
    EXPECT_LT(mark.height, -0.2);
    EXPECT_LT((mark.xy - Eigen::Vector2f(1.6F, 0)).cwiseAbs().maxCoeff(), 0.16);
  }
  EXPECT_FALSE(look.floor_at({1.6, 0}));
}

TEST(GroundObserver, PlainFloorAndWallsHaveNoMarks) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const GroundLook look = look_at({floor_piece(), wall_piece(3)}, seed);
    EXPECT_TRUE(look.marks.empty()) << seed;
    EXPECT_TRUE(look.floor_at({1.6, 0}));
    EXPECT_FALSE(look.floor_at({-1, 0}));
    EXPECT_FALSE(look.floor_at({3.5, 0}));
  }
}

TEST(GroundObserver, WithoutAFloorItSaysNothing) {
  FloorFrontend frontend;
  EXPECT_TRUE(frontend.process(draw({wall_piece(1)}, test_camera(0))).look.empty());
}

}  // namespace
}  // namespace lamina
