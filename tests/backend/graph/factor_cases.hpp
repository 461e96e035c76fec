// States as parameter blocks, and the sightings the factors are tested on.
#pragma once

#include <memory>
#include <vector>

#include <lamina/backend/solver/ceres/costs.hpp>
#include <lamina/backend/solver/ceres/manifolds.hpp>
#include <lamina/testing/factor_tester.hpp>

#include "support/random.hpp"

namespace lamina::test {

using Cost = std::unique_ptr<ceres::CostFunction>;
using Blocks = FactorTester::Blocks;

inline const PoseManifold kPose;
inline const PlaneManifold kPlane;

inline std::vector<double> block(const SE3& pose) {
  std::vector<double> x(7);
  PoseState(pose).write(x.data());
  return x;
}
inline std::vector<double> block(const Plane& plane) {
  std::vector<double> x(4);
  PlaneState(plane).write(x.data());
  return x;
}
inline std::vector<double> block(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

inline SE3 pose_of(const std::vector<double>& x) { return PoseState(x.data()).se3(); }

template <int N>
Eigen::Matrix<double, N, N> some_root(Random& random) {
  Eigen::Matrix<double, N, N> S = Eigen::Matrix<double, N, N>::Identity() * 3;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < i; ++j) S(i, j) = random.normal();
  }
  return S;
}

/// Points on `plane` as seen from `pose`, in the body frame; extent of some metres.
inline Moments seen(const Plane& plane_map, const SE3& pose, const Eigen::Vector3d& near,
                    Random& random, double sigma = 0) {
  Moments moments;
  for (const auto& x : random.points_on(plane_map, near, 2.0, 20, sigma)) {
    moments.add(pose.inverse() * x, sigma > 0 ? 1 / (sigma * sigma) : 1.0);
  }
  return moments;
}

}  // namespace lamina::test
