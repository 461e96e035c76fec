// Small slanting planes at the foot of a wall, and wedges that are there.
#include <gtest/gtest.h>

#include <lamina/backend/consistency/plane_creases.hpp>

namespace lamina {
namespace {

// A floor and a wall at x = 2, seen from twelve keyframes; and a small slope before the wall.
struct Corner {
  Graph graph;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;

  Corner() {
    for (int i = 0; i < 12; ++i) {
      graph.add_keyframe(Timestamp::from_seconds(i), SE3::from_translation({-0.05 * i, 0, 0}));
    }
    see(Plane({0, 0, 1}, 0), {{0, -2, 0}, {2, -2, 0}, {2, 2, 0}, {0, 2, 0}}, 12);
    see(Plane({-1, 0, 0}, -2), {{2, -2, 0}, {2, 2, 0}, {2, 2, 1}, {2, -2, 1}}, 12);
  }
  PlaneId see(const Plane& plane, const std::vector<Eigen::Vector3d>& outline, int views) {
    const PlaneId id = graph.add_plane(PlaneLandmark::at(plane, outline.front()));
    for (int i = 0; i < views; ++i) {
      OutlinePiece piece{graph.keyframes[static_cast<std::size_t>(i)].id, {}};
      const SE3 T = graph.keyframes[static_cast<std::size_t>(i)].T_map_body.inverse();
      for (const auto& p : outline) piece.points_body.push_back(T * p);
      outlines[id].push_back(std::move(piece));
    }
    remake_outline(graph.at(id), outlines[id], graph, 0.1);
    return id;
  }
  // From `front` (m before the wall, on the floor) up to a height at the wall.
  PlaneId slope(double front, double height, int views) {
    const Eigen::Vector3d normal = Eigen::Vector3d(-height, 0, front).normalized();
    const Eigen::Vector3d low(2 - front, -0.5, 0), high(2, -0.5, height);
    const Eigen::Vector3d along(0, 1, 0);
    return see(Plane(normal, normal.dot(low)), {low, high, high + along, low + along}, views);
  }
};

TEST(Creases, TheFootOfAWallIsNoRamp) {
  Corner corner;
  const PlaneId id = corner.slope(0.15, 0.06, 3);
  EXPECT_EQ(creases(corner.graph, corner.outlines), std::set<PlaneId>{id});
}

TEST(Creases, AWedgeThatIsSeenAsOftenAsWhatLiesAroundItStays) {
  Corner corner;
  corner.slope(0.15, 0.06, 7);
  EXPECT_TRUE(creases(corner.graph, corner.outlines).empty());
}

TEST(Creases, AWedgeHigherThanNoiseStays) {
  Corner corner;
  corner.slope(0.5, 0.3, 3);
  EXPECT_TRUE(creases(corner.graph, corner.outlines).empty());
}

TEST(Creases, AGentleRampStays) {
  Corner corner;
  corner.slope(0.4, 0.04, 3);
  EXPECT_TRUE(creases(corner.graph, corner.outlines).empty());
}

TEST(Creases, LinesOfScansAreNone) {
  Corner corner;
  corner.see(Plane(Eigen::Vector3d(-1, 0, 1).normalized(), -2 / std::sqrt(2.0)),
             {{1.98, -0.5, -0.02}, {1.98, 0.5, -0.02}}, 3);
  EXPECT_TRUE(creases(corner.graph, corner.outlines).empty());
}

}  // namespace
}  // namespace lamina
