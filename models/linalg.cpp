// The one place where Eigen's self-adjoint solvers are instantiated.
#include <lamina/models/linalg.hpp>

#include <Eigen/Eigenvalues>

namespace lamina {
namespace {
template <int N>
SymmetricEigen<N> solve(const Eigen::Matrix<double, N, N>& A) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver;
  solver.compute(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}
}  // namespace

SymmetricEigen<2> symmetric_eigen(const Eigen::Matrix2d& A) { return solve<2>(A); }
SymmetricEigen<3> symmetric_eigen(const Eigen::Matrix3d& A) { return solve<3>(A); }
SymmetricEigen<4> symmetric_eigen(const Eigen::Matrix4d& A) { return solve<4>(A); }

}  // namespace lamina
