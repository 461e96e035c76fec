// The small pose graph against closed forms.
#include <gmock/gmock.h>

#include <Eigen/LU>

#include <lamina/frontend/loops/planar_pose_graph.hpp>

namespace lamina {
namespace {

PlanarEdge edge(int from, int to, const PlanarPose& T, double information, bool robust = false) {
  return {from, to, T, information * Eigen::Matrix3d::Identity(), robust};
}

TEST(PlanarPoseGraph, SpreadsALoopsErrorEvenlyOverEqualEdges) {
  PlanarPoseGraph graph;
  for (int i = 0; i < 5; ++i) graph.add_node({1.0 * i, 0, 0});
  for (int i = 0; i < 4; ++i) graph.add_edge(edge(i, i + 1, {1, 0, 0}, 100));
  graph.add_edge(edge(0, 4, {4.4, 0, 0}, 1e8));
  EXPECT_TRUE(graph.optimise());
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(graph.pose(i).x, 1.1 * i, 1e-5);
}

TEST(PlanarPoseGraph, ClosesASquareFromATurnedStart) {
  PlanarPoseGraph graph;
  PlanarPose T;
  for (int i = 0; i < 4; ++i) {
    graph.add_node(T);
    T = T * PlanarPose{2.2, 0.1, 1.4};
  }
  for (int i = 0; i < 4; ++i) graph.add_edge(edge(i, (i + 1) % 4, {2, 0, M_PI / 2}, 10));
  EXPECT_TRUE(graph.optimise());
  EXPECT_NEAR(graph.pose(2).x, 2, 1e-6);
  EXPECT_NEAR(graph.pose(2).y, 2, 1e-6);
  EXPECT_NEAR(graph.pose(3).y, 2, 1e-6);
  for (const PlanarEdge& e : graph.edges()) EXPECT_LT(graph.chi_squared(e), 1e-9);
}

TEST(PlanarPoseGraph, AFalseRobustLoopBendsLittle) {
  PlanarPoseGraph graph;
  for (int i = 0; i < 5; ++i) graph.add_node({1.0 * i, 0, 0});
  for (int i = 0; i < 4; ++i) graph.add_edge(edge(i, i + 1, {1, 0, 0}, 1e4));
  graph.add_edge(edge(0, 4, {-3, 5, 1}, 1e4, true));
  graph.optimise();
  EXPECT_NEAR(graph.pose(4).x, 4, 0.1);
  EXPECT_NEAR(graph.pose(4).y, 0, 0.1);
}

TEST(PlanarPoseGraph, RelativeCovarianceOfAChainIsTheSumCarriedOver) {
  PlanarPoseGraph graph;
  const PlanarPose step{1, 0.2, 0.3};
  PlanarPose T;
  for (int i = 0; i < 4; ++i) {
    graph.add_node(T);
    T = T * step;
  }
  const Eigen::Matrix3d Q = Eigen::Vector3d(1e-4, 2e-4, 3e-4).asDiagonal();
  for (int i = 0; i < 3; ++i) {
    graph.add_edge({i, i + 1, step, Eigen::Vector3d(1e4, 5e3, 1e4 / 3).asDiagonal(), false});
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d Ad = step.inverse().adjoint();
  for (int i = 1; i < 3; ++i) sum = Ad * sum * Ad.transpose() + Q;
  const auto C = graph.relative_covariances({0, 1, 2}, 3);
  EXPECT_LT((C[1] - sum).norm(), 1e-9);
  EXPECT_LT((C[2] - Q).norm(), 1e-9);
  EXPECT_LT((C[0] - (Ad * sum * Ad.transpose() + Q)).norm(), 1e-9);
}

TEST(PlanarPoseGraph, ARemovedNodeLeavesTheGraphAsIfItHadNotBeen) {
  PlanarPoseGraph with, without;
  for (int i = 0; i < 5; ++i) with.add_node({1.0 * i, 0, 0});
  for (int i = 0; i < 4; ++i) without.add_node({1.0 * i, 0, 0});
  for (int i = 0; i < 4; ++i) with.add_edge(edge(i, i + 1, {1, 0, 0}, 100));
  with.add_edge(edge(1, 3, {2.4, 0, 0}, 80));
  with.add_edge(edge(1, 2, {7, 7, 1}, 80));
  with.remove_node(2);
  with.remove_node(2);  // once
  // 0, 1, 3, 4 are 0 to 3 there.
  without.add_edge(edge(0, 1, {1, 0, 0}, 100));
  without.add_edge(edge(2, 3, {1, 0, 0}, 100));
  without.add_edge(edge(1, 2, {2.4, 0, 0}, 80));
  EXPECT_TRUE(with.optimise());
  EXPECT_TRUE(without.optimise());
  EXPECT_NEAR(with.pose(4).x, 4.4, 1e-6);
  EXPECT_NEAR(without.pose(3).x, 4.4, 1e-6);
  EXPECT_EQ(with.pose(2).x, 2);
  const auto found = with.relative_covariances({0, 1, 3}, 4);
  const auto expected = without.relative_covariances({0, 1, 2}, 3);
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_GT(expected[k].norm(), 1e-3);
    EXPECT_LT((found[k] - expected[k]).norm(), 1e-9);
  }
}

// Against the dense inverse, in a graph with loops across.
TEST(PlanarPoseGraph, RelativeCovariancesAreThoseOfTheDenseInverse) {
  constexpr int kNodes = 30;
  PlanarPoseGraph graph;
  std::vector<PlanarPose> poses;
  for (int i = 0; i < kNodes; ++i) {
    poses.push_back(i == 0 ? PlanarPose{} : poses.back() * PlanarPose{0.9, 0.1, 0.25});
    graph.add_node(poses.back());
  }
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3 * kNodes, 3 * kNodes);
  const auto add = [&](int a, int b, double information) {
    const PlanarPose T =
        poses[static_cast<std::size_t>(a)].inverse() * poses[static_cast<std::size_t>(b)];
    graph.add_edge(edge(a, b, T, information));
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 3 * kNodes);
    J.middleCols<3>(3 * a) = -T.inverse().adjoint();
    J.middleCols<3>(3 * b).setIdentity();
    H += information * J.transpose() * J;
  };
  for (int i = 0; i + 1 < kNodes; ++i) add(i, i + 1, 100 + i);
  for (const auto& [a, b] : {std::pair{0, 25}, {3, 27}, {7, 19}, {12, 29}, {2, 14}}) add(a, b, 40);
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(3 * kNodes, 3 * kNodes);
  C.bottomRightCorner(3 * kNodes - 3, 3 * kNodes - 3) =
      H.bottomRightCorner(3 * kNodes - 3, 3 * kNodes - 3).inverse();
  const std::vector<int> from{0, 1, 5, 13, 28};
  for (const int to : {29, 17, 0}) {
    const auto found = graph.relative_covariances(from, to);
    for (std::size_t k = 0; k < from.size(); ++k) {
      const PlanarPose T =
          poses[static_cast<std::size_t>(to)].inverse() * poses[static_cast<std::size_t>(from[k])];
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 3 * kNodes);
      J.middleCols<3>(3 * from[k]) -= T.adjoint();
      J.middleCols<3>(3 * to) += Eigen::Matrix3d::Identity();
      const Eigen::Matrix3d expected = J * C * J.transpose();
      EXPECT_LT((found[k] - expected).norm(), 1e-9 * std::max(1.0, expected.norm()));
    }
  }
}

}  // namespace
}  // namespace lamina
