// Lines that a scanner drew where the ground rises or falls into its plane: no walls.
#pragma once

#include <vector>

#include <lamina/backend/association/outlines.hpp>

namespace lamina {

/// Whether what scans drew of a plane lies on the ground: of points along its strokes (map frame,
/// by the keyframes' present poses) half or more are inside what was seen of a plane of `ground`,
/// and off it by less than 5 cm and less than a third of the scanner's height over the body's
/// origin, which stands on the ground; and the scanner was further off that plane: beams along the
/// top of a pallet do not meet it, but the wall behind.
bool lies_on_ground(const std::vector<OutlinePiece>& strokes, const Graph& graph,
                    const std::vector<const PlaneLandmark*>& ground);

}  // namespace lamina
