// Whether the present estimates hold what loops say.
#pragma once

#include <algorithm>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// The loop's squared error at the graph's poses, over its own covariance, is within 95 % of
/// chi-squared with 6 degrees of freedom. False where it is not a number.
inline bool agrees(const Graph& graph, const LoopFactor& loop) {
  constexpr double kChiSquared = 12.6;
  const SE3 T_from_to = graph.at(loop.from).T_map_body.inverse() * graph.at(loop.to).T_map_body;
  const Vector6d off = (loop.T_from_to.inverse() * T_from_to).log();
  return (loop.sqrt_information * off).squaredNorm() <= kChiSquared;
}

/// The graph's `newest` loops agree, all of them: refining now would move nothing they know of.
inline bool newest_loops_agree(const Graph& graph, int newest) {
  const auto count = std::min(graph.loops.size(), static_cast<std::size_t>(std::max(0, newest)));
  return std::all_of(graph.loops.end() - static_cast<std::ptrdiff_t>(count), graph.loops.end(),
                     [&graph](const LoopFactor& loop) { return agrees(graph, loop); });
}

}  // namespace lamina
