// Weights of doubtful factors, from nearly quadratic kernels to truncated ones.
#include <lamina/backend/robust.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/backend/consensus.hpp>

namespace lamina {
namespace {

template <class F>
void each_doubtful(RobustWeights& values, F&& f) {
  f(FactorType::kPlaneMoments, values.plane_moments);
  f(FactorType::kSegment, values.segments);
  f(FactorType::kLoop, values.loops);
}

double largest(RobustWeights& values) {
  double most = 0;
  each_doubtful(values, [&](FactorType, const std::vector<double>& v) {
    for (const double x : v) most = std::max(most, x);
  });
  return most;
}

/// Geman-McClure with control parameter mu: (mu c^2 / (r^2 + mu c^2))^2; mu = 1 is the kernel
/// itself, a large mu leaves squares.
RobustWeights weights_at(RobustWeights chi2, double c2, double mu) {
  each_doubtful(chi2, [&](FactorType, std::vector<double>& v) {
    for (double& x : v) {
      const double ratio = mu * c2 / (x + mu * c2);
      x = ratio * ratio;
    }
  });
  return chi2;
}

RobustWeights present_weights(const Graph& graph) {
  RobustWeights weights;
  for (const auto& f : graph.plane_moments) weights.plane_moments.push_back(f.weight);
  for (const auto& f : graph.segments) weights.segments.push_back(f.weight);
  for (const auto& f : graph.loops) weights.loops.push_back(f.weight);
  return weights;
}

void store_weights(Graph& graph, const RobustWeights& weights) {
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    graph.plane_moments[i].weight = weights.plane_moments[i];
  }
  for (std::size_t i = 0; i < graph.segments.size(); ++i) {
    graph.segments[i].weight = weights.segments[i];
  }
  for (std::size_t i = 0; i < graph.loops.size(); ++i) graph.loops[i].weight = weights.loops[i];
}

/// Runs minimize() and adds it to the outcome; false when the caller wants to stop.
class Rounds {
 public:
  Rounds(NormalEquations& equations, RobustOutcome& outcome,
         const std::function<bool(const RefineProgress&)>& progress)
      : equations_(equations), outcome_(outcome), progress_(progress) {}

  bool run(const MinimizerOptions& options) {
    const MinimizerResult result = minimize(equations_, options, [&](const Iteration& it) {
      if (!progress_) return true;
      return progress_(
          {outcome_.rounds, outcome_.iterations + it.number, it.cost, it.predicted_decrease});
    });
    outcome_.iterations += result.iterations;
    outcome_.status = result.status;
    outcome_.final_cost = result.final_cost;
    if (first_) outcome_.initial_cost = result.initial_cost;
    first_ = false;
    return result.status != SolveStatus::kCancelled &&
           result.status != SolveStatus::kInvalidInput &&
           result.status != SolveStatus::kNothingToSolve;
  }

 private:
  NormalEquations& equations_;
  RobustOutcome& outcome_;
  const std::function<bool(const RefineProgress&)>& progress_;
  bool first_ = true;
};

RobustWeights truncated(RobustWeights chi2, double limit) {
  each_doubtful(chi2, [&](FactorType, std::vector<double>& v) {
    for (double& x : v) x = x <= limit ? 1.0 : 0.0;
  });
  return chi2;
}

bool same(const RobustWeights& a, const RobustWeights& b) {
  return a.plane_moments == b.plane_moments && a.segments == b.segments && a.loops == b.loops;
}

/// From the widest kernel to the real one; `candidates` are the plane observations that take part.
bool graduate(NormalEquations& equations, const RefineOptions& options,
              const std::vector<double>& candidates, RobustOutcome& outcome, Rounds& rounds) {
  const auto chi2_of_candidates = [&] {
    RobustWeights chi2 = equations.chi_squared();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (candidates[i] == 0) chi2.plane_moments[i] = 0;
    }
    return chi2;
  };
  RobustWeights chi2 = chi2_of_candidates();
  double mu = std::max(1.0, 2 * largest(chi2) / options.inlier_chi2);
  const double ratio = std::max(1.4, std::pow(mu, 1.0 / std::max(1, options.max_rounds - 1)));
  MinimizerOptions few_steps = options.minimizer;
  few_steps.max_iterations = 3;
  for (bool last = false; !last; mu = std::max(1.0, mu / ratio)) {
    last = mu <= 1.0;
    ++outcome.rounds;
    RobustWeights weights = weights_at(chi2_of_candidates(), options.inlier_chi2, mu);
    for (std::size_t i = 0; i < candidates.size(); ++i) weights.plane_moments[i] *= candidates[i];
    equations.set_weights(weights);
    if (!rounds.run(few_steps)) return false;
  }
  return true;
}

/// In or out for every doubtful factor, until the sets stay as they are.
RobustWeights settle(NormalEquations& equations, const RefineOptions& options,
                     RobustOutcome& outcome, Rounds& rounds) {
  constexpr int kMostSettlings = 6;
  RobustWeights weights;
  for (int i = 0; i < kMostSettlings; ++i) {
    RobustWeights next = truncated(equations.chi_squared(), options.inlier_chi2);
    if (i > 0 && same(next, weights)) break;
    weights = std::move(next);
    equations.set_weights(weights);
    ++outcome.rounds;
    if (!rounds.run(options.minimizer)) break;
  }
  return weights;
}

}  // namespace

RobustOutcome minimize_robustly(Graph& graph, NormalEquations& equations,
                                const RefineOptions& options,
                                const std::function<bool(const RefineProgress&)>& progress) {
  RobustOutcome outcome;
  Rounds rounds(equations, outcome, progress);
  RobustWeights weights = present_weights(graph);
  if (!options.robust) {
    equations.set_weights(weights);
    rounds.run(options.minimizer);
    return outcome;
  }
  each_doubtful(weights,
                [](FactorType, std::vector<double>& v) { std::fill(v.begin(), v.end(), 1.0); });
  const bool go_on = rounds.run(options.minimizer);
  RobustWeights chi2 = equations.chi_squared();
  if (go_on && largest(chi2) > options.inlier_chi2) {
    // Not consistent: what the plain solution bent is thrown away.
    const std::vector<double> candidates = agreeing_observations(graph, options.inlier_chi2);
    equations.read(graph);
    if (graduate(equations, options, candidates, outcome, rounds)) {
      weights = settle(equations, options, outcome, rounds);
    }
    each_doubtful(weights, [&](FactorType type, std::vector<double>& v) {
      for (std::size_t i = 0; i < v.size(); ++i) {
        if (v[i] < 0.5) outcome.rejected.push_back({type, i});
      }
    });
  }
  store_weights(graph, weights);
  return outcome;
}

}  // namespace lamina
