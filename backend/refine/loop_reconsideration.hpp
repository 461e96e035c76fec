// Loops that a robust solve left out are heard once more, all together.
#pragma once

#include <lamina/backend/refine/graduated_non_convexity.hpp>

namespace lamina {

/// Robust solves end in one of several minima. Where the map was made on a path that had drifted,
/// walls met again carry the name of a neighbour that stood where they were expected; such views
/// agree with each other, outnumber loops by a hundred to one and outvote them, one loop at a time.
/// So the graph is also solved from where all loops hold: those left out believed far beyond their
/// covariance while views of planes are judged against them, then all judged as ever. The solution
/// of the lower truncated cost (kept factors' chi-squared, and `inlier_chi2` for each view left
/// out, four times that for each loop) stands; a tie leaves it as it was. `graph` and `outcome` are
/// those of minimize_robustly(). Does nothing where no loop was left out, or the solve was stopped.
void reconsider_loops(Graph& graph, const RefineOptions& options,
                      const std::function<bool(const RefineProgress&)>& progress,
                      RobustOutcome& outcome);

}  // namespace lamina
