// Whether the map holds already what loops say.
#include <gtest/gtest.h>

#include <lamina/backend/graph/loop_agreement.hpp>

namespace lamina {
namespace {

// Two keyframes 2 m apart, and loops between them that say they are `said` apart, to 1 cm.
Graph graph_with(const std::vector<double>& said) {
  Graph graph;
  const KeyframeId a = graph.add_keyframe(Timestamp::from_seconds(0), SE3());
  const KeyframeId b = graph.add_keyframe(Timestamp::from_seconds(1), SE3::planar(2, 0, 0));
  for (const double x : said) {
    graph.loops.push_back({a, b, SE3::planar(x, 0, 0), 100 * Matrix6d::Identity()});
  }
  return graph;
}

TEST(NewestLoops, AgreeWithinTheirOwnCovariance) {
  EXPECT_TRUE(newest_loops_agree(graph_with({2.03}), 1));   // chi-squared 9
  EXPECT_FALSE(newest_loops_agree(graph_with({2.04}), 1));  // 16
}

TEST(NewestLoops, OlderOnesAreNotAskedAgain) {
  const Graph graph = graph_with({3, 2, 2});
  EXPECT_TRUE(newest_loops_agree(graph, 2));
  EXPECT_FALSE(newest_loops_agree(graph, 3));
  EXPECT_TRUE(newest_loops_agree(graph, 0));
  EXPECT_FALSE(newest_loops_agree(graph, 100));  // as many as there are
  EXPECT_TRUE(newest_loops_agree(Graph(), 1));
}

}  // namespace
}  // namespace lamina
