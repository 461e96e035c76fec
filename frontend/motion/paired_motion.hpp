// A piece of way as wheels and as scan matching have it.
#pragma once

#include <cmath>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// Motions of one body over one stretch of time, chained by both, and how far wheels went and
/// turned in it, summed without sign.
struct PairedMotion {
  SE3 wheels, scans;
  double way = 0, turn = 0;  ///< m, rad
  Timestamp stamp;           ///< of its end, where it is known

  void add(const SE3& by_wheels, const SE3& by_scans) {
    wheels = wheels * by_wheels;
    scans = scans * by_scans;
    way += by_wheels.translation().norm();
    turn += std::abs(by_wheels.so3().yaw());
  }
};

/// For archives (models/archive.hpp).
template <class A>
void fields(A& a, PairedMotion& v) {
  a(v.wheels, v.scans, v.way, v.turn);
}

}  // namespace lamina
