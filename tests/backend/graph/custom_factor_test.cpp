// Factors and states of a user's own: by both engines, in the window, archived, reported.
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/sphere_manifold.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include <lamina/backend/graph/graph_archive.hpp>
#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/models/error.hpp>

#include "backend/solver/exact.hpp"
#include "support/up_residual.hpp"

namespace lamina {
namespace {

using test::exact;
using test::Up;

using ::testing::HasSubstr;

struct Position {
  Eigen::Vector3d at;
  double sigma;
  template <class T>
  bool operator()(const T* pose, T* r) const {
    for (int i = 0; i < 3; ++i) r[i] = (pose[i] - at(i)) / sigma;
    return true;
  }
};

struct Range {
  double range, sigma;
  template <class T>
  bool operator()(const T* pose, const T* beacon, T* r) const {
    T squares(0);
    for (int i = 0; i < 3; ++i) squares += (beacon[i] - pose[i]) * (beacon[i] - pose[i]);
    r[0] = (sqrt(squares) - range) / sigma;
    return true;
  }
};

CustomFactor position(const std::vector<double>& data) {
  CustomFactor f;
  f.kind = "position";
  f.cost = std::make_shared<ceres::AutoDiffCostFunction<Position, 3, 7>>(
      new Position{{data[0], data[1], data[2]}, data[3]});
  f.may_be_wrong = true;
  f.data = data;
  return f;
}

// A path that odometry bends; positions every third keyframe, one of them far off; ranges to a
// beacon; a direction on the sphere that two keyframes read.
struct Walk {
  Graph graph;
  std::vector<SE3> truth;
  Eigen::Vector3d beacon{4, 6, 2};

  explicit Walk(unsigned seed, std::size_t wrong = 6) {
    std::mt19937 rng(seed);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 30; ++i) {
      truth.push_back(SE3(SO3::rot_z(0.1 * i), {0.4 * i, 0.1 * i * i / 10.0, 0.02 * i}));
      const SE3 T = i == 0 ? truth[0] : graph.keyframes.back().T_map_body * step(i, normal, rng);
      graph.add_keyframe(Timestamp::from_seconds(i), T);
      if (i == 0) continue;
      const Matrix6d S = Vector6d(Vector6d::Constant(1 / 0.02)).asDiagonal();
      graph.odometry.push_back({KeyframeId(i - 1), KeyframeId(i),
                                graph.keyframes[std::size_t(i - 1)].T_map_body.inverse() * T, S});
    }
    graph.keyframes.front().fixed = true;
    CustomState place;
    place.values = Eigen::Vector3d(3, 5, 1);
    const CustomStateId beacon_id = graph.add_custom_state(place);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Eigen::Vector3d t = truth[i].translation();
      if (i % 3 == 0) {
        const double off = i == wrong ? 8 : 0;
        CustomFactor f =
            position({t.x() + off + 0.05 * normal(rng), t.y(), t.z() + 0.05 * normal(rng), 0.05});
        f.states = {KeyframeId(std::int64_t(i))};
        graph.custom.push_back(f);
      }
      CustomFactor f;
      f.kind = "range";
      f.states = {KeyframeId(std::int64_t(i)), beacon_id};
      f.cost = std::make_shared<ceres::AutoDiffCostFunction<Range, 1, 7, 3>>(
          new Range{(beacon - t).norm() + 0.02 * normal(rng), 0.02});
      f.loss = std::make_shared<ceres::HuberLoss>(2.0);
      graph.custom.push_back(f);
    }
    CustomState direction;
    direction.values = Eigen::Vector3d(0, 0.1, 1).normalized();
    direction.manifold = std::make_shared<ceres::SphereManifold<3>>();
    const CustomStateId direction_id = graph.add_custom_state(direction);
    for (const int i : {4, 5}) {
      CustomFactor f;
      f.kind = "up";
      f.states = {KeyframeId(i), direction_id};
      f.cost = std::make_shared<ceres::AutoDiffCostFunction<Up, 3, 7, 3>>(new Up);
      graph.custom.push_back(f);
    }
  }
  SE3 step(int i, std::normal_distribution<double>& normal, std::mt19937& rng) const {
    Vector6d e;
    for (int k = 0; k < 6; ++k) e(k) = 0.02 * normal(rng);
    return truth[std::size_t(i - 1)].inverse() * truth[std::size_t(i)] * SE3::exp(e);
  }
};

TEST(CustomFactor, BothEnginesSolveThemAlike) {
  const Walk walk(3);
  ASSERT_TRUE(walk.graph.problems().empty()) << walk.graph.problems().front();
  Graph native = walk.graph, by_ceres = walk.graph;
  const RefineResult ours = refine(native, exact(SolverEngine::kNative));
  const RefineResult theirs = refine(by_ceres, exact(SolverEngine::kCeres));
  EXPECT_EQ(ours.status, SolveStatus::kConverged);
  ASSERT_EQ(ours.rejected.size(), 1u);  // the position that is far off
  EXPECT_EQ(ours.rejected, theirs.rejected);
  EXPECT_EQ(native.custom[ours.rejected[0].index].kind, "position");
  for (std::size_t i = 0; i < walk.truth.size(); ++i) {
    const SE3 d = native.keyframes[i].T_map_body.inverse() * by_ceres.keyframes[i].T_map_body;
    EXPECT_LT(d.log().norm(), 1e-4) << i;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT((native.custom_states[i].values - by_ceres.custom_states[i].values).norm(), 1e-4);
  }
  EXPECT_LT((native.custom_states[0].values - walk.beacon).norm(), 0.2);
  EXPECT_NEAR(native.custom_states[1].values.norm(), 1, 1e-9);
}

// Weights of one's own stay; a factor of many residuals is judged as one of three.
TEST(CustomFactor, OnlyWhatMayBeWrongIsJudged) {
  Walk walk(3);
  for (CustomFactor& f : walk.graph.custom) {
    if (f.kind == "range") f.weight = 0.5;
  }
  for (const SolverEngine engine : {SolverEngine::kNative, SolverEngine::kCeres}) {
    Graph graph = walk.graph;
    EXPECT_EQ(refine(graph, exact(engine)).rejected.size(), 1u) << to_string(engine);
    for (const CustomFactor& f : graph.custom) {
      if (f.kind == "range") {
        EXPECT_EQ(f.weight, 0.5);
      }
    }
  }
  CustomEvaluation many;
  many.r = Eigen::VectorXd::Ones(30);
  many.chi_squared = 30;
  EXPECT_DOUBLE_EQ(many.chi_squared_of_three(), 3);
}

TEST(CustomFactor, CostsAreReportedByKind) {
  Graph graph = Walk(3).graph;
  const RefineResult result = refine(graph);
  std::map<std::string, std::size_t> factors;
  for (const CostChange& change : result.costs) {
    factors[change.name] = change.factors;
    EXPECT_LE(change.after, change.before + 1e-9 + (change.name == "odometry" ? 1e3 : 0));
  }
  EXPECT_EQ(factors["position"], 10u);
  EXPECT_EQ(factors["range"], 30u);
  EXPECT_EQ(factors["up"], 2u);
}

TEST(CustomFactor, DirectionsOfTheNativeGradientAreThoseOfTheCost) {
  Walk walk(4);
  Graph moved = walk.graph;
  RefineOptions once = exact(SolverEngine::kNative);
  once.robust = false;
  refine(moved, once);
  // At the minimum no single state's step lowers the cost.
  const auto cost = [](const Graph& graph) {
    const auto engine = make_engine(graph, SolverEngine::kCeres);
    return total(engine->cost());
  };
  const double least = cost(moved);
  for (int k = 0; k < 3; ++k) {
    for (const double step : {-1e-3, 1e-3}) {
      Graph other = moved;
      other.custom_states[0].values(k) += step;
      EXPECT_GT(cost(other), least);
      other = moved;
      other.keyframes[9].T_map_body =
          other.keyframes[9].T_map_body * SE3::exp(step * Vector6d::Unit(k));
      EXPECT_GT(cost(other), least);
    }
  }
}

TEST(CustomFactor, ArchivesByKind) {
  register_factor("position", position);
  Graph graph = Walk(5).graph;
  std::erase_if(graph.custom, [](const CustomFactor& f) { return f.kind != "position"; });
  graph.custom_states.clear();
  ArchiveWriter writer;
  writer(graph);
  Graph read;
  ArchiveReader reader(writer.bytes());
  reader(read);
  ASSERT_EQ(read.custom.size(), graph.custom.size());
  EXPECT_TRUE(read.problems().empty());
  Graph a = graph, b = read;
  refine(a);
  refine(b);
  EXPECT_EQ((a.keyframes.back().T_map_body.inverse() * b.keyframes.back().T_map_body).log().norm(),
            0);
  graph.custom.front().kind = "nobody's";
  ArchiveWriter other;
  other(graph);
  try {
    ArchiveReader again(other.bytes());
    again(read);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("nobody's"));
    EXPECT_THAT(error.what(), HasSubstr("register_factor"));
  }
}

TEST(CustomFactor, WhatDoesNotFitIsNamed) {
  Graph graph = Walk(6).graph;
  graph.custom[0].states = {KeyframeId(999)};
  EXPECT_THAT(graph.problems().front(), HasSubstr("'position' refers to a missing state"));
  graph = Walk(6).graph;
  graph.custom[0].states = {KeyframeId(1), KeyframeId(2)};
  EXPECT_THAT(graph.problems().front(), HasSubstr("names 2 states for a cost function of 1"));
  graph = Walk(6).graph;
  graph.custom[0].states = {StateRef(CustomStateId(0))};
  EXPECT_THAT(graph.problems().front(), HasSubstr("a block of 7 numbers for a state of 3"));
  graph = Walk(6).graph;
  graph.custom_states[1].values = Eigen::Vector2d(1, 0);
  EXPECT_THAT(graph.problems().front(), HasSubstr("2 numbers on a manifold of 3"));
  Mapper mapper;
  EXPECT_THROW(mapper.add_factor(position({0, 0, 0, 1})), Error);
  EXPECT_THROW(mapper.add_state(CustomState()), Error);
}

// Through a window that keyframes leave: positions go on holding the path, by either engine.
TEST(CustomFactor, HoldsThePathOfAWindow) {
  for (const SolverEngine engine : {SolverEngine::kNative, SolverEngine::kCeres}) {
    MapperOptions options;
    options.window.engine = engine;
    options.window.keyframes = 6;
    Mapper mapper(options);
    const SE3 drifted(SO3::rot_z(0.01), {0.5, 0.02, 0});  // the way is straight along x
    const Matrix6d C = Vector6d(Vector6d::Constant(0.02 * 0.02)).asDiagonal();
    double off = 0;
    for (int i = 0; i < 30; ++i) {
      Observations nothing;
      nothing.stamp = Timestamp::from_seconds(i);
      const AddResult added = mapper.add(nothing, i == 0 ? SE3() : drifted, C);
      CustomFactor fix = position({0.5 * i, 0, 0, 0.02});
      fix.states = {added.keyframe};
      mapper.add_factor(fix);
      if (i > 3) off = std::max(off, std::abs(added.T_map_body.translation().y()));
    }
    EXPECT_LT(off, 0.15) << to_string(engine);  // 2 m by odometry alone
    EXPECT_EQ(mapper.keyframe_at(Timestamp::from_seconds(12.1))->stamp,
              Timestamp::from_seconds(12));
    EXPECT_FALSE(mapper.keyframe_at(Timestamp::from_seconds(99)).has_value());
    mapper.refine();
    for (const Keyframe& k : mapper.graph().keyframes) {
      EXPECT_NEAR(k.T_map_body.translation().y(), 0, 0.05) << to_string(engine);
    }
  }
}

}  // namespace
}  // namespace lamina
