// How looks are archived.
#pragma once

#include <lamina/grid/evidence/looks.hpp>
#include <lamina/sensors/sensor_archive.hpp>

namespace lamina {

template <class A>
void fields(A& a, SeenRims& v) {
  a(v.stamp, v.T_body_levelled, v.angle_min, v.angle_increment, v.reach, v.rims_levelled);
}
template <class A>
void fields(A& a, SeenGround& v) {
  a(v.stamp, v.T_body_levelled, v.look);
}
template <class A>
void fields(A& a, SeenDepth& v) {
  a(v.stamp, v.T_body_camera, v.look);
}
template <class A>
void fields(A& a, KeptScan& v) {
  a(v.scan, v.from_depth);
}

}  // namespace lamina
