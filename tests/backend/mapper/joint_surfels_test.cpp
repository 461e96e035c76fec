// Floors that are no planes: surfels hold the body's height, roll and pitch, by either engine.
#include <lamina/backend/mapper/joint_surfels.hpp>

#include <gtest/gtest.h>

#include <algorithm>

#include <lamina/backend/mapper/keyframe_retirement.hpp>
#include <lamina/backend/refine/refiner.hpp>

#include "backend/mapper/swelling_floor.hpp"

namespace lamina {
namespace {

using test::on_ground;
using test::patches_ahead;
using test::seen_floor;

JointSurfelOptions on() {
  JointSurfelOptions options;
  options.enabled = true;
  return options;
}

struct Drive {
  Graph graph;
  SurfelEvidence evidence{0.1};
  std::vector<SE3> truth;
};

// 4 m ahead and back beside it, by motions that are off by 5 mm and 0.3 degrees a step.
Drive drive(bool swells, unsigned seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  Drive d;
  for (int i = 0; i < 20; ++i) {
    const double x = 0.4 * (i < 10 ? i : 19 - i), y = i < 10 ? 0 : 0.5;
    SE3 T = on_ground(x, y, i < 10 ? 0 : M_PI);
    if (!swells) T = SE3(SO3::rot_z(i < 10 ? 0 : M_PI), {x, y, 0});
    d.truth.push_back(T);
  }
  Matrix6d S = Matrix6d::Identity();
  S.diagonal() << 500, 500, 200, 200, 200, 500;
  for (std::size_t i = 0; i < d.truth.size(); ++i) {
    SE3 T = d.truth[i];
    if (i > 0) {
      Vector6d noise;
      for (int k = 0; k < 6; ++k) noise(k) = normal(rng) / S(k, k);
      const SE3 moved = d.truth[i - 1].inverse() * d.truth[i] * SE3::exp(noise);
      T = d.graph.keyframes.back().T_map_body * moved;
      const KeyframeId from = d.graph.keyframes.back().id;
      const KeyframeId to = d.graph.add_keyframe({}, T);
      d.graph.odometry.push_back({from, to, moved, S});
    } else {
      d.graph.add_keyframe({}, T);
      d.graph.keyframes.front().fixed = true;
    }
    for (const Moments& patch : patches_ahead(d.truth[i], 0.001, rng)) {
      Moments seen = patch;
      if (!swells) {  // the same places, level
        const Eigen::Vector3d mean(patch.mean().x(), patch.mean().y(), 0.001 * normal(rng));
        Eigen::Matrix3d scatter = patch.scatter();
        scatter.row(2).setZero();
        scatter.col(2).setZero();
        seen = Moments(patch.weight(), mean, scatter, patch.count());
      }
      d.evidence.add(d.graph.keyframes.back().id, seen);
    }
  }
  d.graph.add_plane(seen_floor());
  MarginalPrior prior;  // the floor's plane, as other views have it
  prior.planes = {d.graph.planes.front().id};
  prior.planes_linear = {d.graph.planes.front().plane_anchor};
  prior.sqrt_information = Eigen::Vector3d(300, 300, 200).asDiagonal();
  prior.residual = Eigen::Vector3d::Zero();
  d.graph.marginal_priors.push_back(prior);
  return d;
}

double height_rms(const Graph& graph, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double off = graph.keyframes[i].T_map_body.translation().z() - truth[i].translation().z();
    sum += off * off;
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

TEST(JointSurfels, HoldTheBodysHeightByEitherEngine) {
  for (const unsigned seed : {1u, 2u}) {
    Drive d = drive(true, seed);
    Graph without = d.graph;
    refine(without, {});
    ASSERT_GT(add_joint_surfels(d.graph, d.evidence, on()), 50u);
    EXPECT_TRUE(d.graph.problems().empty());
    Graph native = d.graph, ceres = d.graph;
    RefineOptions options;
    options.minimizer.chi2_tolerance = 1e-8;
    options.minimizer.relative_tolerance = 1e-12;
    EXPECT_EQ(refine(native, options).status, SolveStatus::kConverged);
    options.engine = SolverEngine::kCeres;
    EXPECT_EQ(refine(ceres, options).status, SolveStatus::kConverged);
    for (std::size_t i = 0; i < native.keyframes.size(); ++i) {
      const SE3 off = native.keyframes[i].T_map_body.inverse() * ceres.keyframes[i].T_map_body;
      EXPECT_LT(off.log().norm(), 1e-5);
    }
    EXPECT_LT(height_rms(native, d.truth), 0.5 * height_rms(without, d.truth)) << seed;
    EXPECT_LT(height_rms(native, d.truth), 0.006) << seed;
    remove_surfels(native);
    EXPECT_EQ(native.surfels.size() + native.surfel_moments.size() + native.surfel_parents.size(),
              0u);
  }
}

// Surfels that more than one keyframe saw, of evidence as it is kept after a refinement.
std::size_t tied_after_condensing(const Drive& d, bool joint) {
  MapperOptions options;
  options.joint_surfels.enabled = joint;
  WorkingMap map(options);
  map.graph = d.graph;
  map.surfels = d.evidence;
  GroundView view;
  view.roughness = 0.01;
  view.within_pieces = 0.005;
  for (int i = 0; i < 5; ++i) map.ground.add(view, options.ground);
  EXPECT_TRUE(map.ground.swells());
  KeyframeRetirement retirement;
  retirement.refined(d.graph.keyframes.back().id);
  retirement.condense_floor(map, 1);
  EXPECT_LT(map.surfels.size(), d.evidence.size());
  Graph graph = d.graph;
  add_joint_surfels(graph, map.surfels, on());
  std::map<SurfelId, std::size_t> views;
  for (const SurfelMomentsFactor& f : graph.surfel_moments) ++views[f.surfel];
  const auto tied = std::count_if(views.begin(), views.end(),
                                  [](const auto& surfel) { return surfel.second > 1; });
  return static_cast<std::size_t>(tied);
}

TEST(JointSurfels, CondensedGroundStillTiesKeyframes) {
  const Drive d = drive(true, 3);
  const std::size_t plain = tied_after_condensing(d, false), joint = tied_after_condensing(d, true);
  EXPECT_GT(joint, 200u);
  EXPECT_GT(2 * joint, 3 * plain);
}

TEST(JointSurfels, ALevelFloorHasNone) {
  Drive d = drive(false, 4);
  const std::size_t factors = d.graph.factor_count();
  EXPECT_EQ(add_joint_surfels(d.graph, d.evidence, on()), 0u);
  EXPECT_EQ(d.graph.factor_count(), factors);
}

TEST(JointSurfels, RoughnessIsThatOfTheGround) {
  const Drive d = drive(true, 5);
  Graph graph = d.graph;
  for (std::size_t i = 0; i < d.truth.size(); ++i) graph.keyframes[i].T_map_body = d.truth[i];
  const auto roughness = floor_roughness(graph, d.evidence, on());
  ASSERT_EQ(roughness.size(), 1u);
  // Two waves of amplitudes 12 and 10 mm.
  EXPECT_NEAR(roughness.begin()->second, std::sqrt((0.012 * 0.012 + 0.01 * 0.01) / 2), 0.003);
}

TEST(JointSurfels, AViewSaysNoMoreThanItsPointsShare) {
  Drive d = drive(true, 6);
  JointSurfelOptions options = on();
  add_joint_surfels(d.graph, d.evidence, options);
  std::map<KeyframeId, double> weights;
  for (const auto& f : d.graph.surfel_moments) weights[f.keyframe] += f.moments_body.weight();
  for (const auto& [id, weight] : weights)
    EXPECT_LE(weight, 1.001 / (options.view_sigma_m * options.view_sigma_m));
  options.enabled = false;
  remove_surfels(d.graph);
  EXPECT_EQ(add_joint_surfels(d.graph, d.evidence, options), 0u);
}

}  // namespace
}  // namespace lamina
