// A residual of a user's own, for tests of such factors.
#pragma once

#include <Eigen/Geometry>

namespace lamina::test {

/// A keyframe's up (pose: translation, quaternion x y z w) against a direction on the sphere, by
/// 0.01.
struct Up {
  template <class T>
  bool operator()(const T* pose, const T* direction, T* r) const {
    const Eigen::Quaternion<T> q(pose[6], pose[3], pose[4], pose[5]);
    const Eigen::Matrix<T, 3, 1> up = q.normalized() * Eigen::Matrix<T, 3, 1>(T(0), T(0), T(1));
    for (int i = 0; i < 3; ++i) r[i] = (up(i) - direction[i]) / 0.01;
    return true;
  }
};

}  // namespace lamina::test
