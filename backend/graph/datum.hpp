// Which parts of a graph nothing holds in space.
#pragma once

#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// For each connected part of the graph without a fixed state or a prior: its first keyframe.
std::vector<KeyframeId> keyframes_without_datum(const Graph& graph);

}  // namespace lamina
