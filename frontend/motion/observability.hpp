// What of a motion wheels alone told, beside scans or images that were asked, too.
#pragma once

#include <lamina/models/lie/se3.hpp>

namespace lamina {

struct LeftToWheels {
  bool way = false;      ///< how far it went along its own direction
  bool heading = false;  ///< how far it turned

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, LeftToWheels& v) {
    a(v.way, v.heading);
  }
};

/// Whether what was seen tells a motion worse than wheels do over a metre: these err alike in every
/// step, and scans and images are held to what was seen over metres. `seen`: information of scan or
/// image alone, `by_wheels`: the wheels' covariance; both in the motion's right tangent
/// (translation, rotation; m, rad).
LeftToWheels left_to_wheels(const Matrix6d& seen, const Matrix6d& by_wheels,
                            const SE3& T_prev_curr);

struct DepthMotion;
struct MotionGuess;
/// Likewise of an image with wheels for a guess; one that may show what moved tells nothing.
LeftToWheels left_to_wheels(const DepthMotion& motion, const MotionGuess& wheels);

}  // namespace lamina
