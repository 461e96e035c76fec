// How steps are archived: what the front-ends made of each measurement. Members are bound by name:
// one more, and this no longer compiles until it is archived too.
#pragma once

#include <lamina/frontend/frontend.hpp>
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
  auto& [stamp, sensor, T_body_sensor, first_floor_map, up_body, planes, segments, patches, surfels,
         points] = v;
  a(stamp, sensor, T_body_sensor, first_floor_map, up_body, planes, segments, patches, surfels,
    points);
}
template <class A>
void fields(A& a, ObstacleScan& v) {
  a(v.stamp, v.angle_min, v.angle_increment, v.range_min, v.range_max, v.range, v.cause, v.sigma,
    v.height, v.floor_range);
}

template <class A>
void fields(A& a, Step& v) {
  auto& [observations, motion, known, lost, open, left, by_image, slopes, T_start_body, scan,
         scan_motion, wheels_moved, across, obstacles, T_level, ground, sight] = v;
  a(observations, motion, known, lost, open, left, by_image, slopes, T_start_body, scan,
    scan_motion, wheels_moved, across, obstacles, T_level, ground, sight);
}

}  // namespace lamina
