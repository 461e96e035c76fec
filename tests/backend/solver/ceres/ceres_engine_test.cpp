// Ceres and the own solver agree; covariances agree with a dense inverse.
#include <gtest/gtest.h>

#include <lamina/backend/solver/ceres/ceres_engine.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/mapper/room_generator.hpp"

namespace lamina {
namespace {

/// A graph with every kind of factor that rooms do not have by themselves.
Graph rich_graph() {
  Graph g = make_graph(test::make_rooms({.rooms = 2, .laps = 1}));
  g.priors.push_back({KeyframeId(3), g.keyframes[3].T_map_body, Matrix6d::Identity() * 5});
  g.gravity.push_back({KeyframeId(4), {0.01, 0, 1}, 0.02});
  g.loops.push_back({KeyframeId(0), KeyframeId(9),
                     g.keyframes[0].T_map_body.inverse() * g.keyframes[9].T_map_body,
                     Matrix6d::Identity() * 20});
  g.planar_odometry.push_back({KeyframeId(5), KeyframeId(6),
                               g.keyframes[5].T_map_body.inverse() * g.keyframes[6].T_map_body});
  SurfelLandmark surfel;
  surfel.anchor = KeyframeId(2);
  surfel.T_body_cell = SE3::from_translation({0.5, 0, -1.2});
  const SurfelId id = g.add_surfel(surfel);
  Moments patch;
  for (int i = 0; i < 9; ++i) patch.add({0.45 + 0.05 * (i % 3), 0.05 * (i / 3), -1.19}, 1e4);
  g.surfel_moments.push_back({KeyframeId(2), id, patch});
  const SE3 T_3_2 = g.keyframes[3].T_map_body.inverse() * g.keyframes[2].T_map_body;
  g.surfel_moments.push_back({KeyframeId(3), id, patch.transformed(T_3_2)});
  g.surfel_parents.push_back({id, PlaneId(4)});
  return g;
}

TEST(ProblemBuilder, CeresAgreesWithTheOwnSolver) {
  for (const auto kind : {SolverChoice::Kind::kNormalCholesky, SolverChoice::Kind::kSchur}) {
    Graph ours = rich_graph(), theirs = ours;
    RefineOptions options;
    options.robust = false;
    options.minimizer.chi2_tolerance = 1e-9;
    options.minimizer.relative_tolerance = 1e-12;
    EXPECT_EQ(refine(ours, options).status, SolveStatus::kConverged);
    CeresGraph ceres_graph(theirs);
    SolverChoice choice;
    choice.kind = kind;
    EXPECT_EQ(ceres_graph.solve(options.minimizer, choice).status, SolveStatus::kConverged);
    ceres_graph.write(theirs);
    for (std::size_t i = 0; i < ours.keyframes.size(); ++i) {
      const SE3 difference =
          ours.keyframes[i].T_map_body.inverse() * theirs.keyframes[i].T_map_body;
      EXPECT_LT(difference.log().norm(), 1e-6) << i;
    }
    EXPECT_LT((ours.surfels[0].state - theirs.surfels[0].state).norm(), 1e-6);
  }
}

TEST(ProblemBuilder, ChoosesByShape) {
  EXPECT_EQ(choose_solver(make_graph(test::make_rooms({.rooms = 20}))).kind,
            SolverChoice::Kind::kNormalCholesky);
  Graph window;
  for (int i = 0; i < 20; ++i) window.add_keyframe(Timestamp(), SE3());
  for (int i = 0; i < 60; ++i) window.add_plane(PlaneLandmark());
  const SolverChoice choice = choose_solver(window);
  EXPECT_EQ(choice.kind, SolverChoice::Kind::kSchur);
  EXPECT_FALSE(choice.eliminate_surfels);
}

TEST(Covariance, IsTheInverseOfTheInformation) {
  Graph graph = make_graph(test::make_rooms({.rooms = 1, .laps = 1}));
  refine(graph);
  CovarianceRequest request;
  for (const auto& k : graph.keyframes) request.keyframes.push_back(k.id);
  for (const auto& p : graph.planes) request.planes.push_back(p.id);
  request.joint_keyframes = true;
  const Covariances found = covariances(graph, request);
  ASSERT_TRUE(found.valid);
  EXPECT_EQ(found.weak_directions, 0);
  EXPECT_EQ(found.keyframes[0], Matrix6d::Zero());  // fixed
  // Of the last step before a loop closes nothing: compare with a dense solve of unit vectors.
  NormalEquations equations(graph);
  equations.linearize();
  ASSERT_TRUE(equations.factorize(Eigen::VectorXd::Zero(equations.dimension())));
  const Eigen::Index n = equations.dimension();
  for (const std::size_t pose : {std::size_t{1}, std::size_t{7}}) {
    // Free poses come first, in order, and pose 0 is fixed.
    const auto row = static_cast<Eigen::Index>(6 * (pose - 1));
    for (int k = 0; k < 6; ++k) {
      const Eigen::VectorXd column = equations.solve(Eigen::VectorXd::Unit(n, row + k));
      EXPECT_LT((column.segment<6>(row) - found.keyframes[pose].col(k)).norm(),
                1e-9 * found.keyframes[pose].norm());
      EXPECT_LT((column.segment<6>(0) -
                 found.joint_keyframes.block<6, 1>(6, static_cast<Eigen::Index>(6 * pose) + k))
                    .norm(),
                1e-9 * found.keyframes[pose].norm());
    }
  }
  store_covariances(graph);
  ASSERT_TRUE(graph.planes[0].covariance.has_value());
  EXPECT_EQ(*graph.planes[0].covariance, found.planes[0]);
}

}  // namespace
}  // namespace lamina
