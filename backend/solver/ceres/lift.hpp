// Jacobians to tangents as Ceres wants them: to the ambient numbers, which it multiplies by the
// manifold's PlusJacobian. J_tangent * MinusJacobian is handed over: times PlusJacobian that is
// J_tangent again, as MinusJacobian * PlusJacobian is the identity.
#pragma once

#include <lamina/backend/graph/states.hpp>
#include <lamina/backend/solver/ceres/manifolds.hpp>

namespace lamina {

template <int Rows, int Cols>
using RowMajor = Eigen::Matrix<double, Rows, Cols, Cols == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

inline Eigen::Matrix<double, 6, 7, Eigen::RowMajor> minus_jacobian(const PoseState&,
                                                                   const double* x) {
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> J;
  PoseManifold().MinusJacobian(x, J.data());
  return J;
}
/// In the basis of `plane`, whichever it is.
inline Eigen::Matrix<double, 3, 4, Eigen::RowMajor> minus_jacobian(const PlaneState& plane,
                                                                   const double*) {
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> J;
  J.setZero();
  J.topLeftCorner<2, 3>() = plane.B.transpose();
  J(2, 3) = 1;
  return J;
}

template <class State, class Derived>
void lift(const State& state, const double* x, const Eigen::MatrixBase<Derived>& J_tangent,
          double* out) {
  Eigen::Map<RowMajor<Derived::RowsAtCompileTime, State::kAmbient>> J(out, J_tangent.rows(),
                                                                      State::kAmbient);
  if constexpr (State::kAmbient == State::kTangent) {
    J = J_tangent;
  } else {
    J.noalias() = J_tangent * minus_jacobian(state, x);
  }
}

/// The other way: of a block's numbers, as a cost function gives them, to its tangent.
inline Eigen::MatrixXd to_tangent(const PoseState&, const double* x, const Eigen::MatrixXd& J) {
  Eigen::Matrix<double, 7, 6, Eigen::RowMajor> P;
  PoseManifold().PlusJacobian(x, P.data());
  return J * P;
}
/// In the basis of `plane`, whichever it is.
inline Eigen::MatrixXd to_tangent(const PlaneState& plane, const double*,
                                  const Eigen::MatrixXd& J) {
  Eigen::MatrixXd tangent(J.rows(), 3);
  tangent << J.leftCols<3>() * plane.B, J.col(3);
  return tangent;
}

}  // namespace lamina
