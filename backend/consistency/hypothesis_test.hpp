// Merges that only a motion of the path allows are heard all together.
#pragma once

#include <utility>
#include <vector>

#include <lamina/backend/refine/refiner.hpp>

namespace lamina {

/// Of a refined graph: squared residuals, and `limit` for each view that was rejected, four times
/// that for a loop (cost_of_leaving_out()).
double truncated_cost(const RefineResult& result, double limit);
/// Whether most of these views (indices into Graph::plane_moments) have at least half their weight.
bool most_pinned(const Graph& graph, const std::vector<std::size_t>& views);
/// Gives each observation and loop the weight it has in a copy of the graph.
void take_weights(const Graph& copy, Graph& graph);

/// Pairs (from, into) of planes that cannot both be there (find_seen_through()) and that no small
/// correction makes one: a view with a wrong name holds a stretch of the path where the two are
/// apart, and every pair of that stretch with it. All pairs are taken for one at once, their views
/// believed far beyond their covariance while the others are judged against them, then all judged
/// as ever. A pair whose `from` has most of its views rejected leaves, and the rest is heard anew.
/// What remains stands when the truncated cost rises by less than the limit for each view of the
/// planes that go: with two planes of which one is seen through the other, those are mistaken.
///
/// Returns the pairs that stand; `graph` then has the states and weights of that solution, its
/// planes not yet merged. Otherwise it is as it was. `refined`: what refine() returned for `graph`.
std::vector<std::pair<PlaneId, PlaneId>> test_merge_hypotheses(
    Graph& graph, std::vector<std::pair<PlaneId, PlaneId>> pairs, const RefineResult& refined,
    const RefineOptions& options, const std::function<bool(const RefineProgress&)>& progress);

}  // namespace lamina
