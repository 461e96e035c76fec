// Faces that pass through each other, of which one does not exist.
#pragma once

#include <span>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// Whether an upright plane, as far as it was seen, goes through another one where that was seen,
/// too: in plan most of it lies beside the other, its ends up to 5 cm off on either side, neither
/// three times as far as the other end, turned by up to 10 degrees. Surfaces are opaque: lines of
/// the same face, of returns from far or near its corners, say so. A door ajar or a wedge before a
/// wall meets it at one end. `large`: the plane, then what else was seen of it. Tilts out of the
/// plan, which level scans do not tell, do not count.
bool cross(const PlaneLandmark& small, std::span<const PlaneLandmark* const> large);

}  // namespace lamina
