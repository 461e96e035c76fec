// Believed factors weigh a hundred times as much; the rest is judged round by round.
#include <lamina/backend/refine/pinned_solve.hpp>

#include <algorithm>

#include <lamina/backend/refine/plane_refit.hpp>

namespace lamina {
namespace {

constexpr double kBelief = 100;  // times the information
constexpr int kMostRounds = 5;
constexpr double kSlack = 1.25;  // as in settling: views at the limit do not flip

void weigh(Graph& graph, const Pinned& accepted, double weight) {
  for (const std::size_t i : accepted.loops) graph.loops[i].weight = weight;
  for (const std::size_t i : accepted.plane_moments) graph.plane_moments[i].weight = weight;
}

/// In or out for each view but the believed ones; how many changed.
template <class Factors>
std::size_t judge(Factors& factors, const std::vector<double>& chi2, double limit) {
  std::size_t changed = 0;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (factors[i].weight > 1) continue;
    const bool was = factors[i].weight >= 0.5;
    const bool is = chi2[i] <= limit * (was ? kSlack : 1 / kSlack);
    changed += is == was ? 0 : 1;
    factors[i].weight = is ? 1 : 0;
  }
  return changed;
}

}  // namespace

double cost_of_leaving_out(const std::vector<FactorRef>& rejected, double limit) {
  constexpr double kViewsOfALoop = 4;
  double views = 0;
  for (const FactorRef& f : rejected) views += f.type == FactorType::kLoop ? kViewsOfALoop : 1;
  return limit * views;
}

bool solve_pinned(Graph& graph, const Pinned& accepted, const RefineOptions& options,
                  RobustOutcome& outcome) {
  MinimizerOptions few_steps = options.minimizer;
  few_steps.initial_damping = std::max(1e-10, few_steps.initial_damping);
  few_steps.max_steps = 3;
  weigh(graph, accepted, kBelief);
  bool going = true;
  for (int round = 0; round < kMostRounds && going; ++round) {
    {
      const auto engine = make_engine(graph, options.engine);
      const MinimizerResult result = engine->minimize(few_steps);
      outcome.iterations += result.iterations;
      going = !stopped(result.status);
      if (going) engine->write(graph);
    }
    const RobustWeights chi2 = chi_squared_of(graph);
    const std::size_t changed =
        judge(graph.plane_moments, chi2.plane_moments, options.inlier_chi2) +
        judge(graph.segments, chi2.segments, options.inlier_chi2);
    if (changed == 0) break;
    fit_planes_to_evidence(graph);
  }
  weigh(graph, accepted, 1);
  return going;
}

}  // namespace lamina
