// Loops closed by planes: what the window maps is recognised as an old part of the map.
#pragma once

#include <lamina/backend/mapper/plane_merging.hpp>

namespace lamina {

/// Compares the planes that the present keyframe saw with those beyond the window. Where they are
/// recognised, the window goes on in the old part of the map, its planes absorbed by the old ones;
/// the refiner spreads the difference over the path. False: not recognised, nothing is changed.
bool close_plane_loop(WorkingMap& map, PlaneMerging& merging);

}  // namespace lamina
