// Factors: analytic against automatic derivatives. Covariances of a 2,000-pose map.
//
//   backend_bench [ARGUMENTS OF Google Benchmark]
#include <benchmark/benchmark.h>
#include <ceres/cost_function.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/odometry.hpp>
#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/graph/factors/prior.hpp>
#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/graph/factors/surfel_parent.hpp>
#include <lamina/backend/solver/ceres/costs.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/models/freed_memory.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/graph/factor_twins.hpp"
#include "backend/mapper/room_generator.hpp"

namespace {

using namespace lamina;
using Blocks = std::vector<std::vector<double>>;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// One evaluation with all Jacobians.
void evaluate(benchmark::State& state, const ceres::CostFunction& cost, const Blocks& at) {
  std::vector<const double*> parameters;
  std::vector<std::vector<double>> storage;
  std::vector<double*> jacobians;
  for (const auto& block : at) {
    parameters.push_back(block.data());
    storage.emplace_back(static_cast<std::size_t>(cost.num_residuals()) * block.size());
  }
  for (auto& J : storage) jacobians.push_back(J.data());
  std::vector<double> residuals(static_cast<std::size_t>(cost.num_residuals()));
  for (auto _ : state) {
    cost.Evaluate(parameters.data(), residuals.data(), jacobians.data());
    benchmark::DoNotOptimize(residuals.data());
    benchmark::ClobberMemory();
  }
}

struct Pair {
  std::string name;
  std::shared_ptr<ceres::CostFunction> analytic, automatic;
  Blocks at;
};

std::vector<Pair>& pairs() {
  static std::vector<Pair> all;
  return all;
}

void row(const char* name, ceres::CostFunction* analytic, ceres::CostFunction* automatic,
         const Blocks& at) {
  pairs().push_back({name, std::shared_ptr<ceres::CostFunction>(analytic),
                     std::shared_ptr<ceres::CostFunction>(automatic), at});
}

/// Beside the library's own table: the least time of each, and the ratio of a pair.
class Ratios : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      double& least = least_.try_emplace(run.run_name.function_name, 1e300).first->second;
      least = std::min(least, run.GetAdjustedCPUTime());
    }
  }
  void print() const {
    std::printf("%-26s %11s %11s\n", "factor", "analytic", "autodiff");
    for (const Pair& pair : pairs()) {
      const double ours = least_.at(pair.name + ", analytic");
      const double theirs = least_.at(pair.name + ", autodiff");
      std::printf("%-26s %8.0f ns %8.0f ns   %5.1f x\n", pair.name.c_str(), ours, theirs,
                  theirs / ours);
    }
  }

 private:
  std::map<std::string, double> least_;
};

std::vector<double> block(const SE3& pose) {
  std::vector<double> x(7);
  PoseState(pose).write(x.data());
  return x;
}
std::vector<double> block(const Plane& plane) {
  std::vector<double> x(4);
  PlaneState(plane).write(x.data());
  return x;
}

void factors() {
  const SE3 a(SO3::exp({0.2, 0.1, 1}), {1, 2, 1}), b(SO3::exp({0.1, 0.3, 1.2}), {2, 2.4, 1.1});
  const Plane plane({1, 0.2, 0.1}, 4);
  const Eigen::Vector3d anchor(4, 2, 0);
  const std::vector<double> surfel = {0.01, 0.1, -0.05};
  Moments moments;
  for (int i = 0; i < 20; ++i) moments.add({4, 0.3 * (i % 5), 0.4 * (i / 5)}, 1e3);
  const SE3 T_body_cell = SE3::from_translation({1, 0.4, 0});
  OdometryFactor odometry;
  row("odometry", make_cost(OdometryTerm(odometry)), twins::Odometry::make(odometry),
      {block(a), block(b)});
  PlanarOdometryFactor planar;
  row("planar odometry", make_cost(PlanarOdometryTerm(planar)), twins::PlanarOdometry::make(planar),
      {block(a), block(b)});
  PriorFactor prior;
  row("prior", make_cost(PriorTerm(prior)), twins::Prior::make(prior), {block(a)});
  GravityFactor gravity;
  row("gravity", make_cost(GravityTerm(gravity)),
      new ceres::AutoDiffCostFunction<twins::Gravity, 2, 7>(new twins::Gravity{gravity}),
      {block(a)});
  const PlaneMomentsTerm m(moments, anchor);
  const twins::PlaneMoments m_twin{m.root_weight, m.mean_body, m.anchor_map, m.rows};
  row("plane moments", make_cost(m),
      new ceres::AutoDiffCostFunction<twins::PlaneMoments, 4, 7, 4>(
          new twins::PlaneMoments(m_twin)),
      {block(a), block(plane)});
  const SE3 E = SE3::from_translation({0.2, 0, 1});
  const PlaneMomentsOfSensorTerm e(moments, anchor, Extrinsics::at("depth_camera", E));
  const PlaneMomentsTerm& e_own = e.of_sensor;
  row("plane moments of a sensor", make_cost(e),
      new ceres::AutoDiffCostFunction<twins::PlaneMomentsOfSensor, 4, 7, 4, 7>(
          new twins::PlaneMomentsOfSensor{
              {e_own.root_weight, e_own.mean_body, e_own.anchor_map, e_own.rows}}),
      {block(a), block(plane), block(E)});
  SegmentFactor segment;
  segment.end_body = {1, 2, 0};
  row("segment", make_cost(SegmentTerm(segment, anchor)),
      new ceres::AutoDiffCostFunction<twins::Segment, 2, 7, 4>(new twins::Segment{segment, anchor}),
      {block(a), block(plane)});
  const SurfelMomentsTerm s(moments, T_body_cell);
  row("surfel moments", make_cost(s),
      new ceres::AutoDiffCostFunction<twins::SurfelMoments, 4, 7, 7, 3>(
          new twins::SurfelMoments{s.root_weight, s.mean_body, s.rows, T_body_cell}),
      {block(a), block(b), surfel});
  SurfelParentFactor parent;
  row("surfel parent", make_cost(SurfelParentTerm(parent, T_body_cell, anchor)),
      new ceres::AutoDiffCostFunction<twins::SurfelParent, 3, 7, 4, 3>(
          new twins::SurfelParent{parent, T_body_cell, anchor}),
      {block(a), block(plane), surfel});
  const SurfelMomentsOwnTerm own(moments, T_body_cell);
  row("surfel moments, own", make_cost(own),
      new ceres::AutoDiffCostFunction<twins::SurfelMomentsOwn, 4, 3>(
          new twins::SurfelMomentsOwn{{own.root_weight, own.mean_cell, own.rows_cell, SE3()}}),
      {surfel});
  MarginalPrior marginal;
  marginal.keyframes = {KeyframeId(0)};
  marginal.poses_linear = {b};
  marginal.planes = {PlaneId(0)};
  marginal.planes_linear = {Plane({1, 0.1, 0.1}, 4)};
  marginal.sqrt_information = Eigen::MatrixXd::Ones(5, 9);
  marginal.residual = Eigen::VectorXd::Ones(5);
  row("marginal prior, 6 + 3", make_cost(marginal),
      new ceres::AutoDiffCostFunction<twins::Marginal, 5, 7, 4>(new twins::Marginal{marginal}),
      {block(a), block(plane)});
}

void covariance_times() {
  Graph graph = make_graph(test::make_rooms({.rooms = 91}));
  refine(graph);
  CovarianceRequest request;
  for (std::size_t i = 0; i < 20; ++i) request.keyframes.push_back(graph.keyframes[100 * i + 5].id);
  double best = 1e9;
  for (int i = 0; i < 5; ++i) {
    const double start = cpu_s();
    if (!covariances(graph, request).valid) std::printf("covariances failed\n");
    best = std::min(best, cpu_s() - start);
  }
  std::printf("covariances of 20 poses of %zu: %.1f ms of CPU\n", graph.keyframes.size(),
              1e3 * best);
}

}  // namespace

int main(int argc, char** argv) {
  lamina::keep_freed_memory();  // as the program does
  benchmark::Initialize(&argc, argv);
  factors();
  for (const Pair& pair : pairs()) {
    const auto add = [&pair](const char* kind, const ceres::CostFunction& cost) {
      benchmark::RegisterBenchmark(
          (pair.name + kind).c_str(),
          [&cost, &pair](benchmark::State& state) { evaluate(state, cost, pair.at); })
          ->MinTime(0.02)
          ->Repetitions(10);
    };
    add(", analytic", *pair.analytic);
    add(", autodiff", *pair.automatic);
  }
  Ratios ratios;
  benchmark::RunSpecifiedBenchmarks(&ratios);
  ratios.print();
  covariance_times();
  return 0;
}
