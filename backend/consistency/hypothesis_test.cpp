// Trials on copies of the graph in which planes carry one name.
#include <lamina/backend/consistency/hypothesis_test.hpp>

#include <algorithm>
#include <map>

#include <lamina/backend/refine/graduated_non_convexity.hpp>
#include <lamina/backend/refine/pinned_solve.hpp>
#include <lamina/backend/solver/rotation_initialization.hpp>

namespace lamina {
namespace {

using Pairs = std::vector<std::pair<PlaneId, PlaneId>>;
constexpr int kMostTrials = 5;

/// A copy with one name for each pair, and which views are of a pair.
struct Trial {
  Graph graph;
  std::vector<std::size_t> views;
  std::map<PlaneId, std::vector<std::size_t>> from;  // views of the planes that go

  Trial(const Graph& original, const Pairs& pairs) : graph(original) {
    std::map<PlaneId, PlaneId> into;
    for (const auto& [a, b] : pairs) {
      into[a] = b;
      from[a] = {};
      graph.at(a).active = false;
    }
    const auto of_pair = [&](PlaneId id) {
      return std::any_of(pairs.begin(), pairs.end(),
                         [id](const auto& p) { return p.first == id || p.second == id; });
    };
    for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
      PlaneMomentsFactor& f = graph.plane_moments[i];
      if (f.weight < 0.5 || !of_pair(f.plane)) continue;
      views.push_back(i);
      const auto successor = into.find(f.plane);
      if (successor == into.end()) continue;
      from[f.plane].push_back(i);
      f.plane = successor->second;
    }
    for (SegmentFactor& f : graph.segments) {
      const auto successor = into.find(f.plane);
      if (successor != into.end()) f.plane = successor->second;
    }
    std::erase_if(graph.marginal_priors, [&](const MarginalPrior& prior) {
      return std::any_of(prior.planes.begin(), prior.planes.end(),
                         [&](PlaneId id) { return into.count(id) > 0; });
    });
  }

  bool accepted(PlaneId id) const { return most_pinned(graph, from.at(id)); }
};

template <class Factors>
void take_weights_of(const Factors& from, Factors& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i].weight = from[i].weight;
}

/// The pair whose views fit worst in the mean.
Pairs::iterator worst(const Trial& trial, Pairs& pairs) {
  const std::vector<double> chi2 = chi_squared_of(trial.graph).plane_moments;
  const auto misfit = [&](const std::pair<PlaneId, PlaneId>& pair) {
    const auto& views = trial.from.at(pair.first);
    double sum = 0;
    for (const std::size_t i : views) sum += chi2[i];
    return sum / static_cast<double>(views.size());
  };
  return std::max_element(pairs.begin(), pairs.end(),
                          [&](const auto& a, const auto& b) { return misfit(a) < misfit(b); });
}

}  // namespace

bool most_pinned(const Graph& graph, const std::vector<std::size_t>& views) {
  const auto in = std::count_if(views.begin(), views.end(), [&graph](std::size_t i) {
    return graph.plane_moments[i].weight >= 0.5;
  });
  return 2 * static_cast<std::size_t>(in) > views.size();
}

void take_weights(const Graph& copy, Graph& graph) {
  take_weights_of(copy.plane_moments, graph.plane_moments);
  take_weights_of(copy.segments, graph.segments);
  take_weights_of(copy.loops, graph.loops);
  take_weights_of(copy.custom, graph.custom);
}

double truncated_cost(const RefineResult& result, double limit) {
  double sum = cost_of_leaving_out(result.rejected, limit);
  for (const CostChange& change : result.costs) sum += change.after;
  return sum;
}

Pairs test_merge_hypotheses(Graph& graph, Pairs pairs, const RefineResult& refined,
                            const RefineOptions& options,
                            const std::function<bool(const RefineProgress&)>& progress) {
  for (int k = 0; k < kMostTrials && !pairs.empty(); ++k) {
    Trial trial(graph, pairs);
    RefineOptions pinned = options;
    pinned.refined_before = true;
    pinned.thorough = false;
    pinned.pinned_views = trial.views;
    const RefineResult result = refine(trial.graph, pinned, progress);
    if (stopped(result.status)) return {};
    const std::size_t reconsidered = pairs.size();
    std::erase_if(pairs, [&](const auto& pair) { return !trial.accepted(pair.first); });
    if (pairs.size() < reconsidered) continue;
    std::size_t mistaken = 0;
    for (const auto& [id, views] : trial.from) mistaken += views.size();
    const double limit = options.inlier_chi2;
    if (!(truncated_cost(result, limit) <
          truncated_cost(refined, limit) + limit * static_cast<double>(mistaken))) {
      pairs.erase(worst(trial, pairs));
      continue;
    }
    put_back(states_of(trial.graph), graph);
    take_weights(trial.graph, graph);
    return pairs;
  }
  return {};
}

}  // namespace lamina
