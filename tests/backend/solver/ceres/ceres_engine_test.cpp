// Ceres and the own solver agree; covariances agree with a dense inverse.
#include <gtest/gtest.h>

#include <lamina/backend/refine/refiner.hpp>
#include <lamina/backend/solver/ceres/ceres_engine.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/backend/solver/native/native_engine.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/mapper/room_generator.hpp"
#include "backend/solver/exact.hpp"

namespace lamina {
namespace {

using test::exact;

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

double cost_of(const RefineResult& result) {
  double sum = 0;
  for (const CostChange& change : result.costs) sum += change.after;
  return sum;
}

void expect_same(const Graph& a, const Graph& b, double tolerance) {
  for (std::size_t i = 0; i < a.keyframes.size(); ++i) {
    const SE3 d = a.keyframes[i].T_map_body.inverse() * b.keyframes[i].T_map_body;
    EXPECT_LT(d.log().norm(), tolerance) << i;
  }
  for (std::size_t i = 0; i < a.planes.size(); ++i) {
    EXPECT_LT(a.planes[i].plane_anchor.boxminus(b.planes[i].plane_anchor).norm(), tolerance) << i;
  }
  for (std::size_t i = 0; i < a.surfels.size(); ++i) {
    EXPECT_LT((a.surfels[i].state - b.surfels[i].state).norm(), tolerance) << i;
  }
}

TEST(Engines, AgreeOnEveryKindOfFactor) {
  Graph ours = rich_graph();
  RefineOptions options = exact(SolverEngine::kNative);
  options.robust = false;
  const RefineResult native = refine(ours, options);
  EXPECT_EQ(native.status, SolveStatus::kConverged);
  for (const auto kind : {SolverChoice::Kind::kNormalCholesky, SolverChoice::Kind::kSchur}) {
    Graph theirs = rich_graph();
    SolverChoice choice;
    choice.kind = kind;
    CeresEngine engine(theirs, Parts::kAll, choice);
    const MinimizerResult result = engine.minimize(options.minimizer);
    EXPECT_EQ(result.status, SolveStatus::kConverged);
    EXPECT_NEAR(total(result.final_cost), cost_of(native), 1e-6 * cost_of(native));
    engine.write(theirs);
    expect_same(ours, theirs, 1e-6);
  }
}

TEST(Engines, AgreeWhereViewsCarryWrongNames) {
  Graph ours = make_graph(test::make_rooms({.rooms = 3, .laps = 1, .wrong = 0.1})), theirs = ours;
  const RefineResult native = refine(ours, exact(SolverEngine::kNative));
  const RefineResult ceres = refine(theirs, exact(SolverEngine::kCeres));
  EXPECT_EQ(native.status, SolveStatus::kConverged);
  EXPECT_EQ(ceres.status, SolveStatus::kConverged);
  ASSERT_GT(native.rejected.size(), 0u);
  EXPECT_EQ(native.rejected, ceres.rejected);
  EXPECT_NEAR(cost_of(native), cost_of(ceres), 1e-6 * cost_of(native));
  expect_same(ours, theirs, 1e-5);
}

// A path bent by radians: turns first, positions after.
TEST(Engines, AgreeOnAPathThatTurnsTooFar) {
  Graph ours = make_graph(test::make_rooms({.rooms = 4, .laps = 2, .sigma_rotation = 0.04}));
  Graph theirs = ours;
  RefineOptions options = exact(SolverEngine::kNative);
  options.robust = false;
  const RefineResult native = refine(ours, options);
  options.engine = SolverEngine::kCeres;
  const RefineResult ceres = refine(theirs, options);
  EXPECT_NEAR(cost_of(native), cost_of(ceres), 1e-6 * cost_of(native));
  expect_same(ours, theirs, 1e-4);
}

TEST(Engines, DescribeTheSameProblem) {
  for (const Parts parts : {Parts::kAll, Parts::kTurns}) {
    const Graph graph = rich_graph();
    const NativeEngine native(graph, parts);
    const CeresEngine ceres(graph, parts);
    EXPECT_EQ(native.dimension(), ceres.dimension());
    const CostByType a = native.cost(), b = ceres.cost();
    for (std::size_t t = 0; t < a.size(); ++t) {
      EXPECT_NEAR(a[t], b[t], 1e-9 * (1 + a[t])) << to_string(static_cast<FactorType>(t));
    }
    if (parts == Parts::kTurns) continue;
    const RobustWeights ours = native.chi_squared(), theirs = ceres.chi_squared();
    ASSERT_EQ(ours.plane_moments.size(), theirs.plane_moments.size());
    for (std::size_t i = 0; i < ours.plane_moments.size(); ++i) {
      EXPECT_NEAR(ours.plane_moments[i], theirs.plane_moments[i],
                  1e-6 * (1 + ours.plane_moments[i]));
    }
  }
}

TEST(Engines, StopWhereTheyAreWhenAskedTo) {
  for (const auto kind : {SolverEngine::kNative, SolverEngine::kCeres}) {
    Graph graph = rich_graph();
    const auto engine = make_engine(graph, kind);
    int calls = 0;
    MinimizerOptions options;
    options.chi2_tolerance = options.relative_tolerance = 0;
    const MinimizerResult result =
        engine->minimize(options, [&](const Iteration&) { return ++calls < 2; });
    EXPECT_EQ(result.status, SolveStatus::kCancelled) << to_string(kind);
    EXPECT_EQ(calls, 2) << to_string(kind);
    EXPECT_LT(total(result.final_cost), total(result.initial_cost)) << to_string(kind);
  }
}

TEST(Engines, CountDirectionsThatNothingConstrains) {
  Graph graph = rich_graph();
  graph.add_keyframe(Timestamp::from_seconds(1e3), SE3());  // tied to nothing
  for (const auto kind : {SolverEngine::kNative, SolverEngine::kCeres}) {
    Graph one = graph;
    RefineOptions options = exact(kind);
    options.robust = false;
    const RefineResult result = refine(one, options);
    EXPECT_EQ(result.rank_deficiency + 6 * static_cast<int>(result.held.size()), 6)
        << to_string(kind);
  }
}

TEST(Engines, ChooseByShape) {
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
