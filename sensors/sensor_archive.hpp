// How measurements that are kept are archived (models/archive.hpp).
#pragma once

#include <lamina/models/model_archive.hpp>
#include <lamina/sensors/laser_scan.hpp>
#include <lamina/sensors/odometry.hpp>

namespace lamina {

template <class A>
void fields(A& a, LidarNoise& v) {
  a(v.range_sigma, v.angle_sigma, v.range_floor);
}
template <class A>
void fields(A& a, LidarModel& v) {
  a(v.noise, v.T_body_lidar);
}
template <class A>
void fields(A& a, LaserScan& v) {
  a(v.stamp, v.angle_min, v.angle_increment, v.range_min, v.range_max, v.ranges, v.time_increment,
    v.angles, v.lidar);
}
template <class A>
void fields(A& a, Odometry& v) {
  a(v.stamp, v.T_odom_body, v.interpolated, v.restarted);
}

}  // namespace lamina
