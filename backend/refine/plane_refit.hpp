// Planes fitted to their evidence while the poses stand still.
#pragma once

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// Sets every active, free plane with evidence to the best fit of its merged moments at the present
/// poses, factors weighted by their `weight`. Planes whose evidence does not determine them keep
/// their estimate.
///
/// Where full views decide, the fit is the least eigenvector of the merged scatter. Where scan
/// segments alone or a prior speak of the plane it is the minimum nearest to the present estimate,
/// prior included: segments that lie in one scan plane are fitted best by the scan plane itself.
void fit_planes_to_evidence(Graph& graph);

/// Makes priors that speak of one plane alone stiff in the directions that observations tell less
/// of than they do; returns the graph's priors as they were, to be put back. A prior of a few
/// degrees on the tilt of a wall that one scan plane cuts is honest about its variance, but a
/// direction that nothing measures takes every contradiction between observations: the wall would
/// lie down in the scan plane, where it fits all of them.
std::vector<MarginalPrior> hold_what_nothing_tells(Graph& graph);

}  // namespace lamina
