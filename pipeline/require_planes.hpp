// A map without planes is no map.
#pragma once

#include <lamina/pipeline/map_result.hpp>

namespace lamina {

/// Throws lamina::Error where `result` has no plane: what was skipped, and the warnings as causes.
void require_planes(const MapResult& result);

}  // namespace lamina
