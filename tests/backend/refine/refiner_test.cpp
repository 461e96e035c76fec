// The refiner on generated buildings, benchmark files, and degenerate input.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include <lamina/backend/solver/native/normal_equations.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/mapper/room_generator.hpp"

namespace lamina {
namespace {

using test::make_rooms;
using test::RoomOptions;

bool all_finite(const Graph& graph) {
  for (const auto& k : graph.keyframes) {
    if (!k.T_map_body.matrix().allFinite()) return false;
  }
  for (const auto& p : graph.planes) {
    if (!p.plane_anchor.normal().allFinite() || !std::isfinite(p.plane_anchor.rho())) return false;
  }
  return true;
}

struct Bar {
  const char* file;
  double ate, angle;
};

// Best ATE of the published table plus 1 %.
TEST(Refiner, MeetsTheTableOnBenchmarkFiles) {
  const char* data = std::getenv("LAMINA_DATA");
  const std::filesystem::path folder =
      (data != nullptr ? std::filesystem::path(data)
                       : std::filesystem::path(LAMINA_SOURCE_DIR "/../shared/data")) /
      "plane_graphs";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recordings at " << folder;
  for (const Bar& bar :
       {Bar{"rooms_198", 0.0633 * 1.01, 0.33}, Bar{"rooms_2000", 0.175 * 1.02, 0.53},
        Bar{"rooms_2000_shared_floor", 0.145 * 1.01, 0.29}}) {
    const auto problem = read_plane_graph(folder / (std::string(bar.file) + ".planegraph"));
    const PlaneGraphResult result = solve_plane_graph(problem);
    EXPECT_EQ(result.refine.status, SolveStatus::kConverged) << bar.file;
    EXPECT_LE(result.refine.iterations, 8) << bar.file;
    EXPECT_LE(result.ate_m, bar.ate) << bar.file;
    EXPECT_LE(result.plane_angle_deg, bar.angle) << bar.file;
    EXPECT_TRUE(result.refine.rejected.empty()) << bar.file;
    EXPECT_EQ(result.refine.rank_deficiency, 0) << bar.file;
  }
}

// A robot's origin lies in the floor: by noise a little above or below what it saw of it.
TEST(Refiner, TheFloorUnderABodyKeepsItsSide) {
  for (const double height : {-0.01, 0.0, 0.01}) {
    Graph graph;
    const KeyframeId body = graph.add_keyframe(Timestamp(), SE3::from_translation({0, 0, -height}));
    const PlaneId floor = graph.add_plane(PlaneLandmark::at(Plane({0, 0, 1}, 0), {2, 0, 0}));
    Moments moments;
    for (int i = 0; i < 25; ++i) moments.add({1 + 0.5 * (i % 5), 0.5 * (i / 5) - 1, height}, 1e4);
    graph.plane_moments.push_back({body, floor, moments, ExtrinsicsId::kNone, 1.0});
    fit_planes_to_evidence(graph);
    EXPECT_GT(graph.at(floor).plane_anchor.normal().z(), 0.999) << height;
  }
}

TEST(Refiner, SameResultFarFromTheOrigin) {
  PlaneGraph problem = make_rooms({});
  const PlaneGraphResult near = solve_plane_graph(problem);
  const SE3 away(SO3::exp({0.2, -0.3, 2}), {4000, -3000, 50});
  for (SE3& T : problem.initial_map_body) T = away * T;
  const PlaneGraphResult far = solve_plane_graph(problem);
  EXPECT_EQ(near.refine.iterations, far.refine.iterations);
  for (std::size_t i = 0; i < near.graph.keyframes.size(); ++i) {
    const SE3 moved = away * near.graph.keyframes[i].T_map_body;
    EXPECT_LT((moved.translation() - far.graph.keyframes[i].T_map_body.translation()).norm(), 1e-6);
  }
}

TEST(Refiner, SameBytesTwice) {
  const PlaneGraph problem = make_rooms({});
  const auto a = solve_plane_graph(problem), b = solve_plane_graph(problem);
  for (std::size_t i = 0; i < a.graph.keyframes.size(); ++i) {
    EXPECT_EQ(a.graph.keyframes[i].T_map_body.translation(),
              b.graph.keyframes[i].T_map_body.translation());
  }
}

TEST(Refiner, LostAltitudeAndRollComeBack) {
  PlaneGraph problem = make_rooms({.rooms = 1, .laps = 1, .sigma_point = 0.001});
  Graph truth = solve_plane_graph(problem).graph;
  Graph lost = truth;
  for (std::size_t i = 3; i < lost.keyframes.size(); ++i) {
    SE3& T = lost.keyframes[i].T_map_body;
    T = SE3(T.so3() * SO3::rot_x(22 * M_PI / 180), T.translation() + Eigen::Vector3d(0, 0, 50));
  }
  for (auto& f : lost.odometry) f.sqrt_information *= 1e-4;
  truth.odometry = lost.odometry;
  RefineOptions options;
  options.robust = false;
  refine(truth, options);
  const RefineResult result = refine(lost, options);
  EXPECT_EQ(result.status, SolveStatus::kConverged);
  EXPECT_LE(result.iterations, 10);
  for (std::size_t i = 0; i < lost.keyframes.size(); ++i) {
    const SE3 error = truth.keyframes[i].T_map_body.inverse() * lost.keyframes[i].T_map_body;
    EXPECT_LT(error.translation().norm(), 0.01) << i;
    EXPECT_LT(error.so3().log().norm(), 0.05 * M_PI / 180) << i;
  }
}

TEST(Refiner, DegenerateInputHasADefinedResult) {
  // Nothing at all.
  Graph empty;
  EXPECT_EQ(refine(empty).status, SolveStatus::kNothingToSolve);
  // One wall, seen from three poses without odometry: along it and about its normal nothing holds.
  Graph wall;
  const Plane plane({-1, 0, 0}, -3);
  wall.add_plane(PlaneLandmark::at(plane, {3, 0, 1}));
  Moments seen;
  for (double y = -1; y <= 1; y += 0.5) {
    for (double z = 0; z <= 2; z += 0.5) seen.add({3, y, z}, 1e4);
  }
  for (int i = 0; i < 3; ++i) {
    const KeyframeId id = wall.add_keyframe(Timestamp::from_seconds(i), SE3());
    wall.plane_moments.push_back({id, PlaneId(0), seen.discounted(plane.normal(), {})});
  }
  const RefineResult result = refine(wall);
  EXPECT_EQ(result.status, SolveStatus::kConverged);
  EXPECT_EQ(result.held, std::vector<KeyframeId>{KeyframeId(0)});
  EXPECT_EQ(result.rank_deficiency, 6);  // two poses, three directions each
  EXPECT_TRUE(all_finite(wall));
  EXPECT_FALSE(wall.keyframes[0].fixed);
  // Broken input is said to be broken, and left alone.
  wall.keyframes[1].T_map_body = SE3(SO3(), {std::nan(""), 0, 0});
  const RefineResult broken = refine(wall);
  EXPECT_EQ(broken.status, SolveStatus::kInvalidInput);
  EXPECT_FALSE(broken.problems.empty());
}

TEST(Refiner, APlaneKeepsTheSideItWasSeenFrom) {
  // A robot's body lies on its floor, or below it by an error: its origin tells no side.
  Graph graph;
  Moments floor;
  for (int i = 0; i < 25; ++i) floor.add({0.2 * (i % 5), 0.2 * (i / 5), 0.001}, 1e4);
  const PlaneId id = graph.add_plane(PlaneLandmark::at(Plane({0, 0, 1}, 0), {0, 0, 0}));
  for (int k = 0; k < 3; ++k) {
    const KeyframeId at = graph.add_keyframe(Timestamp::from_nanoseconds(k),
                                             SE3::from_translation({0.3 * k, 0, -0.002}));
    graph.plane_moments.push_back({at, id, floor, ExtrinsicsId::kNone, 1.0});
  }
  fit_planes_to_evidence(graph);
  EXPECT_GT(graph.at(id).plane_anchor.normal().z(), 0.999);
  EXPECT_NEAR(graph.at(id).plane_map().rho(), -0.001, 1e-9);
}

TEST(Refiner, UnconnectedPartsHoldOneKeyframeEach) {
  Graph graph;
  for (int i = 0; i < 4; ++i) graph.add_keyframe(Timestamp(), SE3::planar(i, 0, 0));
  graph.odometry.push_back({KeyframeId(0), KeyframeId(1), SE3::planar(1.2, 0, 0)});
  graph.odometry.push_back({KeyframeId(2), KeyframeId(3), SE3::planar(0.8, 0, 0)});
  const RefineResult result = refine(graph);
  EXPECT_THAT(result.held, testing::ElementsAre(KeyframeId(0), KeyframeId(2)));
  EXPECT_EQ(result.rank_deficiency, 0);
  EXPECT_NEAR(graph.keyframes[1].T_map_body.translation().x(), 1.2, 1e-9);
  EXPECT_NEAR(graph.keyframes[3].T_map_body.translation().x(), 2.8, 1e-9);
}

// A path that is off by more than a radian at its end: from there a first step of all states at
// once winds it up, and ends in a twist of its own. Turns first, then positions.
TEST(Refiner, APathOffByMoreThanARadianIsUnwound) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const PlaneGraph problem = make_rooms({.rooms = 100, .sigma_rotation = 0.012, .seed = seed});
    double off = 0;
    for (std::size_t i = 0; i < problem.truth_map_body.size(); ++i) {
      const SE3 error = problem.truth_map_body[i].inverse() * problem.initial_map_body[i];
      off = std::max(off, error.so3().log().norm());
    }
    ASSERT_GT(off, 1.0) << "seed " << seed;
    RefineOptions options;
    options.robust = false;
    const PlaneGraphResult result = solve_plane_graph(problem, options);
    EXPECT_EQ(result.refine.status, SolveStatus::kConverged) << "seed " << seed;
    // Three told by an observation, six by a step; six unknowns a pose, three a plane.
    const double redundant = 3.0 * static_cast<double>(problem.observations.size()) -
                             3.0 * static_cast<double>(problem.plane_count);
    double cost = 0;
    for (const CostChange& change : result.refine.costs) cost += change.after;
    EXPECT_NEAR(cost / redundant, 1.0, 0.03) << "seed " << seed;
  }
}

// Off by less than a radian, but by enough for steps along tangents to stretch every link: without
// positions that follow, thirteen steps lead to another minimum, 2.2 m off.
TEST(Refiner, ALongPathThatBendsTakesFewSteps) {
  const PlaneGraph problem = make_rooms({.rooms = 150, .sigma_rotation = 0.008, .seed = 8});
  RefineOptions options;
  options.robust = false;
  const PlaneGraphResult result = solve_plane_graph(problem, options);
  EXPECT_EQ(result.refine.status, SolveStatus::kConverged);
  EXPECT_LE(result.refine.iterations, 8);
  EXPECT_LT(result.ate_m, 1.5);
}

TEST(Refiner, TurnsAskedFirstLeadToTheSame) {
  for (const bool far : {false, true}) {
    const PlaneGraph problem =
        make_rooms({.rooms = far ? 100 : 20, .sigma_rotation = far ? 0.012 : 0.002, .seed = 1});
    RefineOptions options;
    options.robust = false;
    const PlaneGraphResult whole = solve_plane_graph(problem, options);
    options.turns_first = 1;
    const PlaneGraphResult turns = solve_plane_graph(problem, options);
    EXPECT_EQ(turns.refine.status, SolveStatus::kConverged);
    EXPECT_NEAR(turns.ate_m, whole.ate_m, 1e-6);
    // A path to be unwound needs one system less; one that is not, one of turns more.
    EXPECT_EQ(turns.refine.iterations, whole.refine.iterations + (far ? -1 : 1));
    ASSERT_EQ(turns.refine.costs.size(), whole.refine.costs.size());
    for (std::size_t i = 0; i < whole.refine.costs.size(); ++i) {
      EXPECT_NEAR(turns.refine.costs[i].before / whole.refine.costs[i].before, 1, 1e-9);
      EXPECT_NEAR(turns.refine.costs[i].after / whole.refine.costs[i].after, 1, 1e-6);
    }
  }
}

// Corridors of one wall: along it and about its normal odometry alone tells; or nothing does.
TEST(Refiner, OnePlaneCorridorsNeverThrowNorGiveNaN) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneGraph problem = make_rooms({.rooms = 1 + static_cast<int>(seed % 2), .seed = seed});
    std::erase_if(problem.observations, [&](const auto& o) { return o.plane != int(seed % 7); });
    if (seed % 3 == 0) problem.odometry.clear();
    if (seed % 5 == 0) {  // every second pose upside down or facing back: turns of pi
      for (std::size_t i = 1; i < problem.initial_map_body.size(); i += 2) {
        SE3& T = problem.initial_map_body[i];
        T = T * SE3(seed % 2 == 0 ? SO3::rot_x(M_PI) : SO3::rot_z(M_PI), Eigen::Vector3d::Zero());
      }
    }
    PlaneGraphResult result;
    ASSERT_NO_THROW(result = solve_plane_graph(problem)) << "seed " << seed;
    EXPECT_TRUE(all_finite(result.graph)) << "seed " << seed;
  }
}

TEST(Refiner, HundredSeedsNeverThrowNorGiveNaN) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    RoomOptions options;
    options.seed = seed;
    options.rooms = seed % 20 == 0 ? 60 : 1 + static_cast<int>(seed % 3);
    options.poses_per_room = 1 + static_cast<int>(seed % 5);
    options.laps = 1 + static_cast<int>(seed % 2);
    options.sigma_rotation = seed % 7 == 0 ? 3.0 : 0.002;
    options.points = 3 + static_cast<int>(seed % 4);
    PlaneGraph problem = make_rooms(options);
    if (seed % 11 == 0) problem.odometry.clear();
    PlaneGraphResult result;
    ASSERT_NO_THROW(result = solve_plane_graph(problem)) << "seed " << seed;
    EXPECT_TRUE(all_finite(result.graph)) << "seed " << seed;
  }
}

TEST(Refiner, BatchIsConsistent) {
  // Total NEES of poses over their degrees of freedom, 20 runs.
  double sum = 0;
  int degrees = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const PlaneGraph problem = make_rooms({.rooms = 2, .poses_per_room = 6, .seed = seed});
    const PlaneGraphResult result = solve_plane_graph(problem);
    NormalEquations equations(result.graph);
    equations.linearize();
    ASSERT_TRUE(equations.factorize(Eigen::VectorXd::Zero(equations.dimension())));
    std::vector<std::size_t> all;
    for (std::size_t i = 1; i < result.graph.keyframes.size(); ++i) all.push_back(i);
    const auto blocks = equations.pose_covariances(all);
    for (std::size_t k = 0; k < all.size(); ++k) {
      const SE3& estimate = result.graph.keyframes[all[k]].T_map_body;
      const Vector6d error = (estimate.inverse() * problem.truth_map_body[all[k]]).log();
      sum += error.dot(blocks[k].llt().solve(error));
      degrees += 6;
    }
  }
  // Poses of one run share their errors, so the mean over 20 runs still scatters by some 10 %.
  EXPECT_NEAR(sum / degrees, 1.0, 0.2);
}

TEST(Refiner, ProgressCanStopIt) {
  const PlaneGraph problem = make_rooms({});
  int calls = 0;
  const PlaneGraphResult result = solve_plane_graph(problem, {}, [&](const RefineProgress& p) {
    ++calls;
    EXPECT_EQ(p.iteration, calls);
    return false;
  });
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(result.refine.status, SolveStatus::kCancelled);
  EXPECT_TRUE(all_finite(result.graph));
}

}  // namespace
}  // namespace lamina
