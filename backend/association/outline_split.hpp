// Whose outline a view's piece is when a plane turns out to be two; and what stands for a piece.
#pragma once

#include <vector>

#include <lamina/backend/association/outlines.hpp>

namespace lamina {

/// After views went from plane `old` to plane `made`: moves the pieces that are of the latter. What
/// keyframes saw that see one of them is of that one, what they saw that see both of the one it
/// lies on. A plane is never left without: where all pieces lie on the other, both keep those of
/// keyframes that see both.
void share_pieces(const Graph& graph, PlaneId old, PlaneId made,
                  std::vector<OutlinePiece>& pieces_old, std::vector<OutlinePiece>& pieces_made);

/// For a plane whose views left no piece: the middles of its views, a cell each. Empty where no
/// keyframe sees it.
OutlineGrid outline_of_views(const PlaneLandmark& plane, const Graph& graph);

}  // namespace lamina
