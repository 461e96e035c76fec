// After the whole graph is refined: planes that turn out to be one are merged, those that turn out
// to be two are parted again, planes that nothing supports leave.
#pragma once

#include <functional>

#include <lamina/backend/mapper/plane_merging.hpp>
#include <lamina/backend/refine/refiner.hpp>

namespace lamina {

/// Planes that are two are parted, planes that are one merged, and the graph solved again, round by
/// round: what ties places together shows more duplicates. Merges that the solution contradicts are
/// undone. `result` is that of the first refinement; the sum of all comes back.
RefineResult revise_planes(WorkingMap& map, PlaneMerging& merging, RefineResult result,
                           const RefineOptions& options,
                           const std::function<bool(const RefineProgress&)>& progress);

/// Takes out planes beyond the window of which the refiner rejected every view: their views were of
/// something else.
void drop_unsupported(WorkingMap& map);

}  // namespace lamina
