// Ceres manifolds of the states. Includes Ceres: for .cpp files of backend/ and tests alone.
#pragma once

#include <ceres/manifold.h>

namespace lamina {

/// SE(3) as 7 numbers (translation, quaternion x y z w), 6 tangents (translation, rotation):
/// Plus(T, d) = T exp(d), Minus(b, a) = log(a^-1 b).
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// S^2 x R as 4 numbers (normal, rho), 3 tangents: Plane::boxplus and boxminus.
class PlaneManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace lamina
