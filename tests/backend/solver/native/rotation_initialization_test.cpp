// Equations of turns alone: their gradient is that of their cost, and nothing is moved.
#include <gtest/gtest.h>

#include <lamina/backend/solver/native/levenberg_marquardt.hpp>
#include <lamina/backend/solver/native/normal_equations.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/mapper/room_generator.hpp"

namespace lamina {
namespace {

/// Odometry, planes, a prior on a pose, one on a camera's mounting, marginal priors on one plane
/// and on two poses and a plane: everything that turns can be told by.
Graph turned_graph() {
  Graph g = make_graph(test::make_rooms({.rooms = 2, .laps = 1, .sigma_rotation = 0.05}));
  g.priors.push_back({KeyframeId(3), SE3::from_translation({4, 1, 2}) * g.keyframes[3].T_map_body,
                      Matrix6d::Identity() * 5});
  g.gravity.push_back({KeyframeId(4), {0.01, 0, 1}, 0.02});
  Extrinsics camera = Extrinsics::at("depth_camera", SE3::from_translation({0.1, 0, 0.5}));
  camera.estimate = true;
  camera.state = camera.state * SE3(SO3::exp({0.01, -0.02, 0.01}), {0.05, 0, 0.02});
  const ExtrinsicsId id = g.add_extrinsics(camera);
  for (std::size_t i = 0; i < g.plane_moments.size(); i += 3) g.plane_moments[i].extrinsics = id;
  for (const bool own : {true, false}) {
    MarginalPrior prior;
    if (!own) {
      prior.keyframes = {KeyframeId(5), KeyframeId(6)};
      for (const KeyframeId k : prior.keyframes) {
        prior.poses_linear.push_back(g.at(k).T_map_body *
                                     SE3(SO3::rot_x(0.02), Eigen::Vector3d::Zero()));
      }
    }
    prior.planes = {PlaneId(2)};
    prior.planes_linear = {g.at(PlaneId(2)).plane_anchor};
    const Eigen::Index n = prior.dimension();
    prior.sqrt_information = Eigen::MatrixXd::Identity(n, n) * 3;
    prior.sqrt_information(0, n - 2) = 1;
    prior.residual = Eigen::VectorXd::Constant(n, 0.1);
    g.marginal_priors.push_back(prior);
  }
  return g;
}

TEST(RotationInitialization, GradientIsThatOfTheCost) {
  const Graph graph = turned_graph();
  ASSERT_TRUE(graph.problems().empty()) << graph.problems().front();
  NormalEquations equations(graph, Parts::kTurns);
  equations.linearize();
  const Eigen::VectorXd gradient = equations.gradient();
  ASSERT_GT(gradient.norm(), 1);
  constexpr double kStep = 1e-6;
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    double cost[2];
    for (const int side : {0, 1}) {
      equations.step(kStep * (2 * side - 1) * Eigen::VectorXd::Unit(gradient.size(), i));
      cost[side] = total(equations.cost());
      equations.undo_step();
    }
    EXPECT_NEAR((cost[1] - cost[0]) / (4 * kStep), gradient(i), 1e-4 * gradient.norm()) << i;
  }
}

TEST(RotationInitialization, NothingIsMoved) {
  const Graph graph = turned_graph();
  NormalEquations equations(graph, Parts::kTurns);
  EXPECT_EQ(minimize(equations, {}).status, SolveStatus::kConverged);
  Graph turned = graph;
  equations.write(turned);
  double most = 0;
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    const SE3& before = graph.keyframes[i].T_map_body;
    const SE3& after = turned.keyframes[i].T_map_body;
    EXPECT_NEAR((after.translation() - before.translation()).norm(), 0, 1e-12) << i;
    most = std::max(most, (before.so3().inverse() * after.so3()).log().norm());
  }
  EXPECT_GT(most, 0.01);
  EXPECT_EQ(turned.extrinsics[0].state.log(), graph.extrinsics[0].state.log());
}

}  // namespace
}  // namespace lamina
