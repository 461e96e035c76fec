// How steps are archived: what the front-ends made of each measurement.
#pragma once

#include <lamina/apps/front_end.hpp>
#include <lamina/sensors/sensor_archive.hpp>

namespace lamina {

template <class A>
void fields(A& a, PlaneObservation& v) {
  a(v.plane_sensor, v.moments_sensor, v.floor, v.outline_sensor, v.kind);
}
template <class A>
void fields(A& a, SegmentObservation& v) {
  a(v.segment, v.floor, v.track);
}
template <class A>
void fields(A& a, FloorPatch& v) {
  a(v.moments_sensor, v.floor);
}
template <class A>
void fields(A& a, Observations& v) {
  a(v.stamp, v.sensor, v.T_body_sensor, v.planes, v.segments, v.floor_patches, v.surfels_body,
    v.obstacle_points_body);
}
template <class A>
void fields(A& a, ObstacleScan& v) {
  a(v.stamp, v.angle_min, v.angle_increment, v.range_min, v.range_max, v.range, v.cause, v.sigma,
    v.height, v.floor_range);
}

namespace apps {

template <class A>
void fields(A& a, Step& v) {
  a(v.observations, v.motion, v.motion_known, v.T_start_body, v.scan, v.scan_motion, v.obstacles,
    v.T_body_levelled);
}

}  // namespace apps
}  // namespace lamina
