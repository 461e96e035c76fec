// Factors of a user's own in their graph: on their manifolds, with their noise, by both engines.
#include <ceres/loss_function.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <lamina/backend/graph/states.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/backend/solver/ceres/manifolds.hpp>
#include <lamina/models/error.hpp>
#include <lamina/testing/factor_tester.hpp>
#include <lamina/testing/report_impl.hpp>
#include <lamina/testing/whiteness.hpp>

namespace lamina {

using detail::failure;

namespace {

// The numbers of a state and the manifold they are on.
struct Block {
  std::vector<double> numbers;
  const ceres::Manifold* manifold = nullptr;
};

Block block_of(KeyframeId id, const Graph& graph) {
  static const PoseManifold kPose;
  Block block{std::vector<double>(PoseState::kAmbient), &kPose};
  PoseState(graph.at(id).T_map_body).write(block.numbers.data());
  return block;
}

Block block_of(CustomStateId id, const Graph& graph) {
  const CustomState& state = graph.at(id);
  return {std::vector<double>(state.values.begin(), state.values.end()), state.manifold.get()};
}

// rho' is the derivative of rho, rho'' that of rho', rho(0) = 0 and rho rises.
FactorReport check_loss(const ceres::LossFunction& loss) {
  std::array<double, 3> at{}, above{}, below{};
  loss.Evaluate(0, at.data());
  if (at[0] != 0) return failure("the loss of 0 is ", at[0]);
  for (const double s : {0.01, 0.3, 0.9, 2.0, 7.0, 30.0, 500.0}) {
    const double step = 1e-4 * s;
    loss.Evaluate(s, at.data());
    loss.Evaluate(s + step, above.data());
    loss.Evaluate(s - step, below.data());
    const double slope = (above[0] - below[0]) / (2 * step);
    if (!(std::abs(at[1] - slope) <= 1e-5 * std::max(1.0, std::abs(slope)))) {
      return failure("the loss's slope at ", s, " is ", at[1], ", numeric ", slope);
    }
    if (!(at[1] >= 0)) return failure("the loss falls at ", s);
  }
  return {};
}

FactorReport check_archive(const CustomFactor& factor, const Graph& graph) {
  CustomEvaluation ours, anew;
  CustomFactor made;
  try {
    made = make_factor(factor.kind, factor.data);
  } catch (const Error& error) {
    return failure(error.what());
  }
  made.states = factor.states;
  if (const std::string problem = problem_of(made, graph); !problem.empty()) {
    return failure("made anew from its archive it ", problem);
  }
  const bool good = evaluate_at(factor, graph, ours), also_good = evaluate_at(made, graph, anew);
  if (good == also_good && (!good || (ours.r == anew.r && ours.robust == anew.robust))) return {};
  return failure("made anew from its archive it gives ", anew.r.transpose(), " (robust ",
                 anew.robust, ") in place of ", ours.r.transpose(), " (", ours.robust, ")");
}

double distance(const CustomState& a, const CustomState& b) {
  if (!a.manifold) return (a.values - b.values).norm();
  Eigen::VectorXd d(a.tangent());
  return a.manifold->Minus(b.values.data(), a.values.data(), d.data())
             ? d.norm()
             : (a.values - b.values).norm();
}

struct Solved {
  Graph graph;
  RefineResult result;
  double cost = 0;
};

Solved solved_by(SolverEngine engine, const Graph& graph) {
  Solved solved{graph, {}, 0};
  RefineOptions options;
  options.engine = engine;
  options.minimizer.chi2_tolerance = 1e-9;  // to the last digits
  options.minimizer.relative_tolerance = 1e-12;
  solved.result = refine(solved.graph, options);
  for (const CostChange& change : solved.result.costs) solved.cost += change.after;
  return solved;
}

}  // namespace

FactorReport check_factor(const CustomFactor& factor, const Graph& graph,
                          const FactorCheck& check) {
  if (const std::string problem = problem_of(factor, graph); !problem.empty()) {
    return failure("the factor ", problem);
  }
  FactorTester::Blocks at;
  std::vector<const ceres::Manifold*> manifolds;
  for (const StateRef& state : factor.states) {
    Block block = std::visit([&graph](auto id) { return block_of(id, graph); }, state);
    at.push_back(std::move(block.numbers));
    manifolds.push_back(block.manifold);
  }
  FactorReport report = FactorTester(*factor.cost, manifolds).check_all({at}, check);
  if (report && factor.loss) report = check_loss(*factor.loss);
  if (report && check.archived) report = check_archive(factor, graph);
  return report;
}

FactorReport noise_is_as_stated(const Graph& truth,
                                const std::function<CustomFactor(std::mt19937_64&)>& draw,
                                int samples, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Whiteness residuals;
  for (int i = 0; i < samples; ++i) {
    const CustomFactor factor = draw(random);
    if (const std::string problem = problem_of(factor, truth); !problem.empty()) {
      return failure("draw ", i, " of seed ", seed, ": the factor ", problem);
    }
    CustomEvaluation evaluation;
    if (!evaluate_at(factor, truth, evaluation)) {
      return failure("draw ", i, " of seed ", seed, ": Evaluate failed at the truth");
    }
    residuals.add(evaluation.r);
  }
  if (residuals.white()) return {};
  return failure("whitened residuals of seed ", seed, " have mean ", residuals.mean().transpose(),
                 " and covariance\n", residuals.covariance());
}

FactorReport engines_agree(const Graph& graph, double tolerance) {
  const Solved native = solved_by(SolverEngine::kNative, graph);
  const Solved by_ceres = solved_by(SolverEngine::kCeres, graph);
  for (const Solved* solved : {&native, &by_ceres}) {
    if (solved->result.status == SolveStatus::kConverged) continue;
    const auto& problems = solved->result.problems;
    return failure(solved == &native ? "native" : "ceres", " ended ",
                   to_string(solved->result.status), problems.empty() ? "" : ": ",
                   problems.empty() ? "" : problems.front());
  }
  if (native.result.rejected != by_ceres.result.rejected) {
    return failure("native left out ", native.result.rejected.size(), " factors, ceres ",
                   by_ceres.result.rejected.size(), " or others");
  }
  if (!(std::abs(native.cost - by_ceres.cost) <= 1e-6 * (1 + native.cost))) {
    return failure("costs are ", native.cost, " by native and ", by_ceres.cost, " by ceres");
  }
  for (std::size_t i = 0; i < native.graph.keyframes.size(); ++i) {
    const SE3& T = by_ceres.graph.keyframes[i].T_map_body;
    const double off = (native.graph.keyframes[i].T_map_body.inverse() * T).log().norm();
    if (!(off <= tolerance)) return failure("keyframe ", i, " differs by ", off);
  }
  for (std::size_t i = 0; i < native.graph.custom_states.size(); ++i) {
    const double off = distance(native.graph.custom_states[i], by_ceres.graph.custom_states[i]);
    if (!(off <= tolerance)) return failure("custom state ", i, " differs by ", off);
  }
  return {};
}

}  // namespace lamina
