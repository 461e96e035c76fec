// Coplanar walls beside an opening, cupboards before a wall, doors; rings round parts.
#include <gtest/gtest.h>

#include <lamina/backend/consistency/opening_split.hpp>

namespace lamina {
namespace {

// A robot that drives along x, from -3 to 3 at y = 0, past what lies in y = 2 and y = 5.
struct Passage {
  Graph graph;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;
  PlaneId wall = PlaneId::kNone;

  Passage() {
    for (int i = -3; i <= 3; ++i) {
      graph.add_keyframe(Timestamp::from_seconds(i + 3), SE3::from_translation({1.0 * i, 0, 0}));
    }
  }
  // Stretches of one wall at this distance, seen from every keyframe.
  PlaneId see(double y, const std::vector<std::pair<double, double>>& stretches) {
    PlaneLandmark plane = PlaneLandmark::at(Plane({0, -1, 0}, -y), {0, y, 1});
    plane.outline = OutlineGrid(0.1);
    std::vector<OutlinePiece> pieces;
    for (const auto& keyframe : graph.keyframes) {
      const SE3 T_body_map = keyframe.T_map_body.inverse();
      for (const auto& [from, to] : stretches) {
        pieces.push_back({keyframe.id,
                          {T_body_map * Eigen::Vector3d(from, y, 0.5),
                           T_body_map * Eigen::Vector3d(to, y, 0.5)}});
      }
    }
    const PlaneId id = graph.add_plane(std::move(plane));
    remake_outline(graph.at(id), pieces, graph, 0.1);
    outlines[id] = std::move(pieces);
    return id;
  }
  std::size_t walls() const {
    const auto apart = walls_apart(graph, outlines, 1.5);
    const auto found = apart.find(wall);
    return found == apart.end() ? 1 : found->second.size();
  }
};

TEST(WallsApart, ACrossingIsAnOpeningWhereARoomBehindIsSeenThroughIt) {
  Passage crossing;
  crossing.wall = crossing.see(2, {{-4, -1.1}, {1.1, 4}});
  EXPECT_EQ(crossing.walls(), 1u);  // nobody saw anything through it yet
  crossing.see(5, {{-4, 4}});
  ASSERT_EQ(crossing.walls(), 2u);
  const auto parts = walls_apart(crossing.graph, crossing.outlines, 1.5).at(crossing.wall);
  EXPECT_NEAR(parts[0].area() + parts[1].area(), crossing.graph.at(crossing.wall).outline.area(),
              1e-9);
}

TEST(WallsApart, ACrossingThatWasDrivenThroughIsAnOpening) {
  Passage crossing;
  crossing.wall = crossing.see(2, {{-4, -0.9}, {0.9, 4}});
  for (double x = -0.8; x < 1; x += 0.2) {
    for (const double y : {1.5, 2.5}) {
      crossing.graph.add_keyframe(Timestamp::from_seconds(20), SE3::from_translation({x, y, 0}));
    }
  }
  EXPECT_EQ(crossing.walls(), 2u);
}

TEST(WallsApart, ADoorInterruptsAWall) {
  Passage door;
  door.wall = door.see(2, {{-4, -0.5}, {0.5, 4}});
  door.see(5, {{-4, 4}});
  EXPECT_EQ(door.walls(), 1u);
}

TEST(WallsApart, AWallBehindACupboardIsOne) {
  Passage cupboard;
  cupboard.wall = cupboard.see(2, {{-4, -1.1}, {1.1, 4}});
  cupboard.see(1.5, {{-1.1, 1.1}});
  EXPECT_EQ(cupboard.walls(), 1u);
}

TEST(WallsApart, LevelPlanesAreLeftAlone) {
  Passage hall;
  PlaneLandmark top = PlaneLandmark::at(Plane({0, 0, 1}, 0.7), {0, 2, 0.7});
  top.outline = OutlineGrid(0.1);
  const SE3 T_outline_map = top.T_map_outline.inverse();
  for (const double x : {-3.0, 3.0}) {
    top.outline.add(Eigen::Vector2d((T_outline_map * Eigen::Vector3d(x, 2, 0.7)).head<2>()));
  }
  hall.wall = hall.graph.add_plane(std::move(top));
  hall.see(5, {{-4, 4}});
  EXPECT_EQ(hall.walls(), 1u);
}

TEST(Ring, GoesRoundAllPartsByStripsACellWide) {
  PlaneLandmark wall = PlaneLandmark::at(Plane({0, -1, 0}, -2), {0, 2, 1});
  wall.outline = OutlineGrid(0.1);
  EXPECT_TRUE(ring_map(wall).empty());
  for (const double x : {0.0, 2.0, 4.0}) {
    const std::vector<Eigen::Vector3d> part{{x, 2, 0}, {x + 1, 2, 0}, {x + 1, 2, 1}, {x, 2, 1}};
    grow_outline(wall, part);
  }
  ASSERT_EQ(outlines_map(wall).size(), 3u);
  const auto ring = ring_map(wall);
  std::vector<Eigen::Vector2d> flat;
  double low = 1e9, high = -1e9;
  for (const auto& p : ring) {
    EXPECT_NEAR(p.y(), 2, 1e-9);
    flat.emplace_back(p.x(), p.z());
    low = std::min(low, p.x());
    high = std::max(high, p.x());
  }
  EXPECT_NEAR(low, 0, 0.11);
  EXPECT_NEAR(high, 5, 0.11);
  const auto polygon = Polygon::from_vertices(flat);
  ASSERT_TRUE(polygon);
  EXPECT_NEAR(polygon->area(), wall.outline.area(), 0.5);  // two strips of 1 m by 0.1, and corners
}

}  // namespace
}  // namespace lamina
