// Small symmetric eigenproblems behind plain functions: instantiating Eigen's solvers costs the
// compiler seconds a file, so one file pays for all.
#pragma once

#include <Eigen/Core>

namespace lamina {

/// Ascending eigenvalues, eigenvectors in columns (right-handed is not promised). Only the lower
/// triangle is read. Backward stable; input must be finite.
template <int N>
struct SymmetricEigen {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};
SymmetricEigen<2> symmetric_eigen(const Eigen::Matrix2d& A);
SymmetricEigen<3> symmetric_eigen(const Eigen::Matrix3d& A);
SymmetricEigen<4> symmetric_eigen(const Eigen::Matrix4d& A);

}  // namespace lamina
