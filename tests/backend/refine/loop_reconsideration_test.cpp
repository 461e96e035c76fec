// Loops that were left out for views that carry a neighbour's name.
#include <gtest/gtest.h>

#include <lamina/backend/refine/loop_reconsideration.hpp>
#include <lamina/backend/refine/pinned_solve.hpp>

namespace lamina {
namespace {

constexpr double kShift = 0.2;  // m, of the way back: as far as the next wall
constexpr int kOut = 5, kBack = 5;

SE3 at(double x, double y) { return SE3(SO3(), {x, y, 0}); }

// A view of `plane` from `pose`, both in the map: sigmas 1 cm and 0.6 degrees.
PlaneMomentsFactor view(KeyframeId id, const SE3& pose, PlaneId name, const Plane& plane) {
  const Plane body = pose.inverse() * plane;
  const Matrix32d B = body.tangent_basis();
  const Eigen::Matrix3d scatter = 1e4 * B * B.transpose();
  return {id, name, Moments(1e4, body.project(Eigen::Vector3d::Zero()), scatter, 100),
          ExtrinsicsId::kNone, 1.0};
}

// Out and back along a corridor; the way back ends up kShift aside, by odometry. Most views there
// name their walls, six the walls that stand kShift further on. Loops say the truth.
struct Corridor {
  Graph graph;
  std::vector<Plane> walls;

  Corridor() {
    for (const double y : {1.0, 1.0 + kShift, -1.0 + kShift, -1.0}) {
      const Eigen::Vector3d n(0, y > 0 ? -1 : 1, 0);
      walls.emplace_back(n, n.y() * y);
    }
    walls.emplace_back(Eigen::Vector3d(-1, 0, 0), -9.0);
    walls.emplace_back(Eigen::Vector3d(0, 0, 1), 0.0);
    for (const Plane& wall : walls) {
      PlaneLandmark plane;
      plane.plane_anchor = wall;
      graph.add_plane(plane);
    }
    for (int k = 0; k < kOut + kBack; ++k) add_keyframe(k);
    graph.keyframes.front().fixed = true;
  }

  static SE3 truth(int k) { return at(k < kOut ? k : kOut + kBack - 1 - k, 0); }

  void add_keyframe(int k) {
    const bool back = k >= kOut;
    const KeyframeId id =
        graph.add_keyframe(Timestamp(), at(truth(k).translation().x(), back ? kShift : 0));
    const auto see = [&](int name, int wall) {
      graph.plane_moments.push_back(
          view(id, truth(k), PlaneId(name), walls[static_cast<std::size_t>(wall)]));
      return graph.plane_moments.size() - 1;
    };
    for (const int wall : {0, 3}) {
      const std::size_t i = see(wall, wall);
      if (back) left_out.push_back({FactorType::kPlaneMoments, i});
    }
    for (const int wall : {4, 5}) see(wall, wall);
    if (!back) {
      see(1, 1);
      see(2, 2);
    } else if (k < kOut + 3) {
      for (const auto& [name, wall] : {std::pair(1, 0), std::pair(2, 3)}) {
        wrong.push_back({FactorType::kPlaneMoments, see(name, wall)});
      }
    }
    if (k == 0) return;
    Matrix6d S = Matrix6d::Identity() * 100;
    // Much happened on the way to the turn.
    if (k == kOut) S = Matrix6d::Identity() * 2;
    const auto before = static_cast<KeyframeId>(k - 1);
    graph.odometry.push_back({before, id, truth(k - 1).inverse() * truth(k), S});
  }

  void add_loop(int from, int to, const SE3& error) {
    left_out.push_back({FactorType::kLoop, graph.loops.size()});
    graph.loops.push_back({KeyframeId(from), KeyframeId(to),
                           truth(from).inverse() * truth(to) * error, Matrix6d::Identity() * 50,
                           1.0});
  }

  // The solution that leaves `rejected` out.
  RobustOutcome solve_without(const std::vector<FactorRef>& rejected) {
    for (auto& f : graph.plane_moments) f.weight = 1;
    for (auto& f : graph.loops) f.weight = 1;
    for (const FactorRef& f : rejected) {
      (f.type == FactorType::kLoop ? graph.loops[f.index].weight
                                   : graph.plane_moments[f.index].weight) = 0;
    }
    RobustOutcome outcome;
    outcome.engine = make_engine(graph, SolverEngine::kNative);
    const MinimizerResult result = outcome.engine->minimize({});
    outcome.engine->write(graph);
    outcome.status = result.status;
    outcome.final_cost = result.final_cost;
    outcome.rejected = rejected;
    return outcome;
  }

  double worst() const {
    double worst = 0;
    for (int k = 0; k < kOut + kBack; ++k) {
      const SE3 off = truth(k).inverse() * graph.at(KeyframeId(k)).T_map_body;
      worst = std::max(worst, off.translation().norm());
    }
    return worst;
  }

  std::vector<FactorRef> left_out, wrong;
};

TEST(LoopHearing, LoopsOutvotedByWrongNamesAreHeard) {
  Corridor corridor;
  for (int k = 0; k < 4; ++k) corridor.add_loop(k, kOut + kBack - 1 - k, SE3());
  RobustOutcome outcome = corridor.solve_without(corridor.left_out);
  ASSERT_NEAR(corridor.worst(), kShift, 0.01);  // where robust solves may end
  // It is a minimum: judged from there, nothing changes.
  RefineOptions options;
  options.refined_before = true;
  Graph again = corridor.graph;
  ASSERT_EQ(minimize_robustly(again, options, {}).rejected.size(), corridor.left_out.size());
  reconsider_loops(corridor.graph, {}, {}, outcome);
  EXPECT_LT(corridor.worst(), 0.01);
  EXPECT_EQ(outcome.rejected, corridor.wrong);
  EXPECT_EQ(outcome.status, SolveStatus::kConverged);
}

TEST(LoopHearing, AWrongLoopChangesNothing) {
  Corridor corridor;
  corridor.add_loop(1, kOut + kBack - 2, at(0.5, 0.3));
  std::vector<FactorRef> rejected = corridor.wrong;
  rejected.push_back({FactorType::kLoop, 0});
  RobustOutcome outcome = corridor.solve_without(rejected);
  ASSERT_LT(corridor.worst(), 0.01);
  const Graph before = corridor.graph;
  reconsider_loops(corridor.graph, {}, {}, outcome);
  EXPECT_EQ(outcome.rejected, rejected);
  for (std::size_t k = 0; k < before.keyframes.size(); ++k) {
    EXPECT_EQ(before.keyframes[k].T_map_body.translation(),
              corridor.graph.keyframes[k].T_map_body.translation());
  }
}

TEST(LoopHearing, ALoopLeftOutCostsAsMuchAsFourViews) {
  EXPECT_EQ(cost_of_leaving_out({}, 25), 0);
  std::vector<FactorRef> rejected = {{FactorType::kPlaneMoments, 0}, {FactorType::kSegment, 7}};
  EXPECT_EQ(cost_of_leaving_out(rejected, 25), 2 * 25);
  rejected.push_back({FactorType::kLoop, 0});
  EXPECT_EQ(cost_of_leaving_out(rejected, 25), 6 * 25);
}

TEST(LoopHearing, WithoutALoopLeftOutNothingIsSolved) {
  Corridor corridor;
  RobustOutcome outcome = corridor.solve_without(corridor.left_out);
  reconsider_loops(corridor.graph, {}, {}, outcome);
  EXPECT_EQ(outcome.iterations, 0);
  EXPECT_NEAR(corridor.worst(), kShift, 0.01);
}

}  // namespace
}  // namespace lamina
