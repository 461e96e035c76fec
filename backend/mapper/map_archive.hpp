// How maps at rest are archived.
#pragma once

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/graph/graph_archive.hpp>
#include <lamina/backend/mapper/map_state.hpp>

namespace lamina {

template <class A>
void fields(A& a, OutlinePiece& v) {
  a(v.keyframe, v.points_body);
}
template <class A>
void fields(A& a, MapFrame& v) {
  a(v.stamp, v.keyframe, v.T_keyframe_body);
}
template <class A>
void fields(A& a, MapState& v) {
  a(v.graph, v.frames, v.left_window, v.outlines, v.partial, v.surfels, v.loose_body,
    v.extrinsics_covariance, v.wheel_covariance);
}

}  // namespace lamina
