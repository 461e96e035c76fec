// Weights of doubtful factors, from nearly quadratic kernels to truncated ones.
#include <lamina/backend/refine/graduated_non_convexity.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/backend/refine/consensus.hpp>
#include <lamina/backend/refine/plane_refit.hpp>
#include <lamina/backend/refine/track_planes.hpp>
#include <lamina/backend/solver/rotation_initialization.hpp>
#include <lamina/models/median.hpp>

namespace lamina {
namespace {

template <class F>
void each_doubtful(RobustWeights& values, F&& f) {
  f(FactorType::kPlaneMoments, values.plane_moments);
  f(FactorType::kSegment, values.segments);
  f(FactorType::kLoop, values.loops);
  f(FactorType::kCustom, values.custom);
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

void store_weights(Graph& graph, const RobustWeights& weights) {
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    graph.plane_moments[i].weight = weights.plane_moments[i];
  }
  for (std::size_t i = 0; i < graph.segments.size(); ++i) {
    graph.segments[i].weight = weights.segments[i];
  }
  for (std::size_t i = 0; i < graph.loops.size(); ++i) graph.loops[i].weight = weights.loops[i];
  for (std::size_t i = 0; i < graph.custom.size(); ++i) {
    if (graph.custom[i].may_be_wrong) graph.custom[i].weight = weights.custom[i];
  }
}

/// Runs minimize() on the graph and keeps count.
class Rounds {
 public:
  Rounds(Graph& graph, SolverEngine engine, RobustOutcome& outcome,
         const std::function<bool(const RefineProgress&)>& progress)
      : graph_(graph), engine_(engine), outcome_(outcome), progress_(progress) {}

  /// Takes in the factors the graph's weights leave.
  BatchEngine& renew() {
    outcome_.engine.reset();  // frees its memory first
    outcome_.engine = make_engine(graph_, engine_);
    return *outcome_.engine;
  }
  /// False when the caller wants to stop, or there is nothing to go on with.
  bool run(const MinimizerOptions& options) { return take(minimize_once(options)); }
  /// The same for all factors that have a weight, from the graph as it is. A path that the first
  /// step turns too far is unwound: by turns alone, then positions. One of many keyframes is asked
  /// by turns at once, whose system is smaller.
  bool run_unwinding(const MinimizerOptions& options, std::size_t turns_first) {
    renew();
    CostByType cost{};
    bool far = false;
    if (graph_.keyframes.size() >= turns_first) {
      cost = outcome_.engine->cost();
      far = unwind(cost, kTurnsPay);
    }
    if (!far) {
      const MinimizerResult result =
          minimize_once(options, {.largest_first_turn = kLargestTurn, .follow_from_turn = kBends});
      if (!result.turns_too_far) return take(result);
      outcome_.iterations += result.iterations;
      cost = result.initial_cost;
      unwind(cost, 0);
    }
    MinimizerResult result = minimize_once(options, {.follow_from_turn = 0});
    result.initial_cost = cost;
    return take(result);
  }
  void write() { outcome_.engine->write(graph_); }

 private:
  bool unwind(const CostByType& cost, double least_turn) {
    const RotationInitialization start =
        start_from_turns(graph_, *outcome_.engine, engine_, total(cost), least_turn);
    outcome_.iterations += start.iterations;
    return start.far;
  }
  bool take(const MinimizerResult& result) {
    outcome_.iterations += result.iterations;
    outcome_.status = result.status;
    outcome_.final_cost = result.final_cost;
    if (first_) outcome_.initial_cost = result.initial_cost;
    first_ = false;
    return !stopped(result.status);
  }
  MinimizerResult minimize_once(const MinimizerOptions& options, const LongPath& path = {}) {
    return outcome_.engine->minimize(
        options,
        [&](const Iteration& it) {
          if (!progress_) return true;
          return progress_(
              {outcome_.rounds, outcome_.iterations + it.number, it.cost, it.predicted_decrease});
        },
        path);
  }

  Graph& graph_;
  SolverEngine engine_;
  RobustOutcome& outcome_;
  const std::function<bool(const RefineProgress&)>& progress_;
  bool first_ = true;
};

/// In or out. What was in before leaves only well beyond the limit, and what was out comes back
/// only well within, so that no factor at the limit flips for ever. `before` may be empty.
RobustWeights judged(RobustWeights chi2, double limit, const RobustWeights& before) {
  constexpr double kSlack = 1.25;
  const auto judge_all = [limit](std::vector<double>& v, const std::vector<double>& was) {
    for (std::size_t i = 0; i < v.size(); ++i) {
      const double slack = was.empty() ? 1.0 : was[i] > 0.5 ? kSlack : 1 / kSlack;
      v[i] = v[i] <= slack * limit ? 1.0 : 0.0;
    }
  };
  judge_all(chi2.plane_moments, before.plane_moments);
  judge_all(chi2.segments, before.segments);
  judge_all(chi2.loops, before.loops);
  judge_all(chi2.custom, before.custom);
  return chi2;
}

bool same(const RobustWeights& a, const RobustWeights& b) {
  return a.plane_moments == b.plane_moments && a.segments == b.segments && a.loops == b.loops &&
         a.custom == b.custom;
}

/// Median chi-squared of what has to be drawn together: loops, and observations outside their
/// plane's largest group. Most of them are right and off by the drift; the wrong ones lie beyond,
/// where a kernel of this width no longer hears them.
double typical_misfit(const RobustWeights& chi2, const Agreement& agreement) {
  std::vector<double> misfits = chi2.loops;
  misfits.insert(misfits.end(), chi2.segments.begin(), chi2.segments.end());
  for (std::size_t i = 0; i < chi2.plane_moments.size(); ++i) {
    if (agreement.weights[i] > 0 && !agreement.in_largest[i]) {
      misfits.push_back(chi2.plane_moments[i]);
    }
  }
  if (misfits.empty()) return 0;
  return median(misfits);
}

/// From a kernel `mu` times as wide in chi-squared to the real one, over the factors the graph's
/// weights leave. False: stopped.
bool graduate(double mu, const RefineOptions& options, RobustOutcome& outcome, Rounds& rounds) {
  BatchEngine& engine = *outcome.engine;
  const double ratio = std::max(1.4, std::pow(mu, 1.0 / std::max(1, options.max_rounds - 1)));
  MinimizerOptions few_steps = options.minimizer;
  few_steps.max_iterations = 15;
  few_steps.max_steps = 3;
  few_steps.relative_tolerance = 1e-4;  // the next level moves the states by more
  for (bool last = false; !last; mu = std::max(1.0, mu / ratio)) {
    last = mu <= 1.0;
    ++outcome.rounds;
    engine.set_weights(weights_at(engine.chi_squared(), options.inlier_chi2, mu));
    if (!rounds.run(few_steps)) return false;
  }
  return true;
}

/// In or out for every doubtful factor, a few steps each time, until the sets stay as they are;
/// then to convergence with the sets fixed. What the converged solution says of them may start it
/// again, a few times: the last word is a converged solution of fixed sets.
bool settle(Graph& graph, const RefineOptions& options, RobustOutcome& outcome, Rounds& rounds) {
  constexpr int kMostLoose = 6, kMostFull = 3;
  MinimizerOptions few_steps = options.minimizer;
  few_steps.initial_damping = std::max(1e-10, few_steps.initial_damping);
  few_steps.max_steps = 2;
  RobustWeights weights;
  bool converging = false;
  for (int loose = 0, full = 0; full < kMostFull;) {
    rounds.write();
    RobustWeights next = judged(chi_squared_of(graph), options.inlier_chi2, weights);
    const bool stands = loose + full > 0 && same(next, weights);
    if (stands && converging) break;
    converging = converging || stands || loose >= kMostLoose;
    if (!stands) {
      weights = std::move(next);
      store_weights(graph, weights);
      // A plane whose evidence changed may be far from it, and Newton slow to turn it: the poses
      // are good by now, so its best fit is too.
      fit_planes_to_evidence(graph);
      rounds.renew();
    }
    ++(converging ? full : loose);
    ++outcome.rounds;
    if (!rounds.run(converging ? options.minimizer : few_steps)) return false;
  }
  return true;
}

std::vector<FactorRef> rejected_factors(const Graph& graph) {
  std::vector<FactorRef> rejected;
  const auto look = [&](FactorType type, const auto& factors) {
    for (std::size_t i = 0; i < factors.size(); ++i) {
      if (factors[i].weight < 0.5) rejected.push_back({type, i});
    }
  };
  look(FactorType::kPlaneMoments, graph.plane_moments);
  look(FactorType::kSegment, graph.segments);
  look(FactorType::kLoop, graph.loops);
  for (std::size_t i = 0; i < graph.custom.size(); ++i) {
    const CustomFactor& factor = graph.custom[i];
    if (factor.may_be_wrong && factor.weight < 0.5) rejected.push_back({FactorType::kCustom, i});
  }
  return rejected;
}

/// How much wider than for good the kernel is in a second hearing, in chi-squared.
constexpr double kWideReconsideration = 20;

/// A second hearing for what a settled solution left out but is not far from: rooms that were torn
/// off by a few sigmas of drift come back, names that are wrong stay far away.
bool reconsider(Graph& graph, const RefineOptions& options, RobustOutcome& outcome,
                Rounds& rounds) {
  rounds.write();
  store_weights(graph,
                judged(chi_squared_of(graph), kWideReconsideration * options.inlier_chi2, {}));
  rounds.renew();
  RefineOptions careful = options;
  careful.minimizer.initial_damping = std::max(1e-10, options.minimizer.initial_damping);
  return graduate(kWideReconsideration, careful, outcome, rounds) &&
         settle(graph, options, outcome, rounds);
}

/// A track is decided as a whole: its rejected views are heard as views of the surface it saw.
/// Where the robot was is told by all that it saw, whatever it was named.
void reconsider_tracks(Graph& graph, const Tracks& tracks, const RefineOptions& options,
                       RobustOutcome& outcome, Rounds& rounds) {
  constexpr int kHearings = 2;
  const TrackViews reconsidered(graph);
  bool going = true;
  for (int reconsidering = 0; reconsidering < kHearings && going; ++reconsidering) {
    rounds.write();
    reconsidered.remove(graph);
    if (!reconsidered.add(graph, tracks, kWideReconsideration * options.inlier_chi2)) return;
    rounds.renew();
    going = reconsider(graph, options, outcome, rounds);
  }
  rounds.write();
  reconsidered.remove(graph);
}

/// What the plain solution says about the doubtful factors.
enum class Verdict { kConsistent, kFewOutliers, kContradiction };

Verdict judge(RobustWeights chi2, double limit) {
  std::size_t all = 0, beyond = 0;
  each_doubtful(chi2, [&](FactorType, const std::vector<double>& v) {
    all += v.size();
    for (const double x : v) beyond += x <= limit ? 0 : 1;
  });
  if (beyond == 0) return Verdict::kConsistent;
  // A few far out in a solution they did not bend need no fresh start.
  const bool few = beyond <= std::max<std::size_t>(1, all / 500) && largest(chi2) < 10 * limit;
  return few ? Verdict::kFewOutliers : Verdict::kContradiction;
}

/// From scratch: candidates by agreement, kernels from wide to narrow, then all factors judged.
bool solve_suspecting(Graph& graph, const Agreement& agreement, const RefineOptions& options,
                      RobustOutcome& outcome, Rounds& rounds) {
  // Planes start from their largest groups.
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    graph.plane_moments[i].weight = agreement.in_largest[i] ? 1 : 0;
  }
  fit_planes_to_evidence(graph);
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    graph.plane_moments[i].weight = agreement.weights[i];
  }
  // While sets still change, the weakest modes are held a little: they would follow every mistake.
  RefineOptions careful = options;
  careful.minimizer.initial_damping = std::max(1e-10, options.minimizer.initial_damping);
  const double misfit = typical_misfit(rounds.renew().chi_squared(), agreement);
  const double widest = std::max(1.0, 2 * misfit / options.inlier_chi2);
  return graduate(widest, careful, outcome, rounds) && settle(graph, options, outcome, rounds);
}

/// Keyframes from which a path is asked by its turns first. What was refined before needs no
/// unwinding, as a rule.
std::size_t turns_first(const RefineOptions& options) {
  return options.refined_before ? std::numeric_limits<std::size_t>::max() : options.turns_first;
}

/// What the plain solution says of the factors. A contradiction leaves the graph as it was.
Verdict solve_plainly(Graph& graph, const RefineOptions& options, RobustOutcome& outcome,
                      Rounds& rounds) {
  // Consistent problems hardly ever have a step that raises the cost.
  constexpr int kMostRejections = 4;
  const bool rejected_before = !rejected_factors(graph).empty();
  const GraphStates start = states_of(graph);
  MinimizerOptions plain = options.minimizer;
  plain.max_rejections = kMostRejections;
  // Stopped: what there is stands.
  if (!rounds.run_unwinding(plain, turns_first(options))) return Verdict::kConsistent;
  const Verdict verdict = judge(outcome.engine->chi_squared(), options.inlier_chi2);
  if (verdict == Verdict::kContradiction) {
    put_back(start, graph);
    return options.refined_before ? Verdict::kFewOutliers : verdict;
  }
  return verdict == Verdict::kConsistent && rejected_before ? Verdict::kFewOutliers : verdict;
}

}  // namespace

RobustOutcome minimize_robustly(Graph& graph, const RefineOptions& options,
                                const std::function<bool(const RefineProgress&)>& progress) {
  RobustOutcome outcome;
  Rounds rounds(graph, options.engine, outcome, progress);
  if (!options.robust) {
    rounds.run_unwinding(options.minimizer, turns_first(options));
    rounds.write();
    return outcome;
  }
  const Agreement agreement = agreeing_observations(graph, options.inlier_chi2);
  const bool named_wrong = agreement.conflicts > graph.plane_moments.size() / 500;
  const Verdict verdict =
      named_wrong ? Verdict::kContradiction : solve_plainly(graph, options, outcome, rounds);
  // The plain solution was never written: the graph is still where it began.
  if (named_wrong) {
    const Tracks tracks = geometric_tracks(graph, options.inlier_chi2);
    follow_tracks(graph, tracks, options);
    if (solve_suspecting(graph, agreement_of(graph, tracks), options, outcome, rounds)) {
      reconsider(graph, options, outcome, rounds);
      reconsider_tracks(graph, tracks, options, outcome, rounds);
    }
  } else if (verdict == Verdict::kContradiction) {
    solve_suspecting(graph, agreement, options, outcome, rounds);
  } else if (verdict == Verdict::kFewOutliers) {
    settle(graph, options, outcome, rounds);
  }
  rounds.write();
  outcome.rejected = rejected_factors(graph);
  return outcome;
}

}  // namespace lamina
