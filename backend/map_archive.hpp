// How maps at rest are archived.
#pragma once

#include <lamina/backend/graph_archive.hpp>
#include <lamina/backend/map_state.hpp>

namespace lamina {

template <class A>
void fields(A& a, MapFrame& v) {
  a(v.stamp, v.keyframe, v.T_keyframe_body);
}
template <class A>
void fields(A& a, MapState& v) {
  a(v.graph, v.frames, v.left_window, v.outlines, v.partial, v.surfels, v.loose_body,
    v.mounting_doubt, v.wheel_doubt);
}

}  // namespace lamina
