// The graph's bookkeeping.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {
namespace {

using testing::HasSubstr;

Graph small_graph() {
  Graph graph;
  for (int i = 0; i < 3; ++i) {
    graph.add_keyframe(Timestamp::from_seconds(i), SE3::planar(i, 0, 0));
    graph.add_plane(PlaneLandmark::at(Plane(Eigen::Vector3d::UnitX(), 5 + i), {5, 1, 1}));
  }
  graph.odometry.push_back({KeyframeId(0), KeyframeId(1), SE3::planar(1, 0, 0)});
  graph.odometry.push_back({KeyframeId(1), KeyframeId(2), SE3::planar(1, 0, 0)});
  graph.plane_moments.push_back({KeyframeId(1), PlaneId(2), Moments()});
  return graph;
}

TEST(Graph, FindsByIdAlsoAfterRemoval) {
  Graph graph = small_graph();
  EXPECT_TRUE(graph.problems().empty());
  EXPECT_EQ(graph.remove(KeyframeId(1)), 3u);
  EXPECT_EQ(graph.find(KeyframeId(1)), nullptr);
  ASSERT_NE(graph.find(KeyframeId(2)), nullptr);
  EXPECT_DOUBLE_EQ(graph.at(KeyframeId(2)).T_map_body.translation().x(), 2);
  EXPECT_EQ(graph.add_keyframe(Timestamp(), SE3()), KeyframeId(3));
  EXPECT_EQ(graph.factor_count(), 0u);
  EXPECT_THROW(graph.at(KeyframeId(1)), std::logic_error);
}

TEST(Graph, MergedPlaneHandsOverItsEvidence) {
  Graph graph = small_graph();
  PlaneLandmark& from = graph.at(PlaneId(2));
  from.observations = 4;
  from.outline.add(Eigen::Vector2d(0.25, 0.35));
  const Eigen::Vector3d seen = from.T_map_outline * Eigen::Vector3d(0.25, 0.35, 0);
  graph.merge_planes(PlaneId(2), PlaneId(0));
  EXPECT_EQ(graph.plane_moments[0].plane, PlaneId(0));
  EXPECT_EQ(graph.at(PlaneId(0)).observations, 4);
  EXPECT_FALSE(graph.at(PlaneId(2)).active);
  EXPECT_EQ(graph.at(PlaneId(2)).merged_into, PlaneId(0));
  const PlaneLandmark& into = graph.at(PlaneId(0));
  EXPECT_TRUE(into.outline.contains((into.T_map_outline.inverse() * seen).head<2>()));
}

TEST(Graph, PlaneKeepsItsOutlineFrameWhenItMoves) {
  PlaneLandmark plane = PlaneLandmark::at(Plane(Eigen::Vector3d::UnitX(), 5), {5, 1, 1});
  EXPECT_NEAR(plane.plane_map().rho(), 5, 1e-12);
  const SE3 before = plane.T_map_outline;
  // Across n.z = 0 the tangent basis jumps; the outline's frame must not.
  for (const double z : {1e-6, -1e-6}) {
    plane.set_plane_anchor(Plane({1, 0, z}, 0.01));
    EXPECT_LT((before.inverse() * plane.T_map_outline).log().norm(), 0.011);
    EXPECT_NEAR(plane.plane_map().signed_distance(plane.T_map_outline.translation()), 0, 1e-12);
  }
}

TEST(Graph, NamesWhatIsWrong) {
  Graph graph = small_graph();
  graph.odometry[0].to = KeyframeId(7);
  graph.odometry[1].to = graph.odometry[1].from;
  graph.planes[0].anchor_map.x() = std::nan("");
  graph.marginal_priors.push_back({{KeyframeId(0)}, {}, {}, {}, {}, {}, {}, {}});
  const auto problems = graph.problems();
  ASSERT_EQ(problems.size(), 4u);
  EXPECT_THAT(problems[0], HasSubstr("plane 0: holds a number that is not finite"));
  EXPECT_THAT(problems[1], HasSubstr("odometry 0: refers to missing id 7"));
  EXPECT_THAT(problems[2], HasSubstr("odometry 1: joins a keyframe to itself"));
  EXPECT_THAT(problems[3], HasSubstr("marginal_prior 0: sizes do not agree"));
}

}  // namespace
}  // namespace lamina
