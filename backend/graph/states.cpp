// Logarithm on the sphere and roots of scatter matrices.
#include <lamina/backend/graph/states.hpp>

#include <cmath>

#include <lamina/models/linalg.hpp>

namespace lamina {

Eigen::Vector2d sphere_log(const Eigen::Vector3d& n0, const Matrix32d& B0, const Eigen::Vector3d& n,
                           Eigen::Matrix<double, 2, 3>* dv_dn) {
  const Eigen::Vector2d s = B0.transpose() * n;
  const double c = n0.dot(n);
  const double sine = s.norm();
  if (sine < 1e-6 && c > 0) {
    // theta / sin(theta) = 1 + s^2 / 6 to the last digit.
    const double factor = 1.0 + sine * sine / 6.0;
    if (dv_dn != nullptr) *dv_dn = factor * B0.transpose();
    return factor * s;
  }
  if (sine < 1e-12) {
    if (dv_dn != nullptr) dv_dn->setZero();
    return {M_PI, 0};
  }
  const double theta = std::atan2(sine, c);
  const double ratio = theta / sine;
  if (dv_dn != nullptr) {
    const Eigen::RowVector3d dsine = (s.transpose() / sine) * B0.transpose();
    const Eigen::RowVector3d dtheta = (c * dsine - sine * n0.transpose()) / (sine * sine + c * c);
    *dv_dn = ratio * B0.transpose() + s * ((dtheta - ratio * dsine) / sine);
  }
  return ratio * s;
}

PlaneState PlaneState::carried(const Eigen::Vector3d& d) const {
  const SO3 turn = SO3::exp(n.cross(B * d.head<2>()));
  PlaneState result;
  result.n = (turn * n).normalized();
  const Eigen::Vector3d b0 = turn * Eigen::Vector3d(B.col(0));
  result.B.col(0) = (b0 - b0.dot(result.n) * result.n).normalized();
  result.B.col(1) = result.n.cross(Eigen::Vector3d(result.B.col(0)));
  result.rho = rho + d.z();
  return result;
}

Eigen::Vector3d PlaneState::minus(const PlaneState& origin) const {
  Eigen::Vector3d d;
  d << sphere_log(origin.n, origin.B, n, nullptr), rho - origin.rho;
  return d;
}

PlaneState PlaneState::turned(const Eigen::Matrix3d& R) const {
  PlaneState result;
  result.n = R * n;
  result.B = R * B;
  result.rho = rho;
  return result;
}

Eigen::Matrix3d scatter_root(const Eigen::Matrix3d& scatter) {
  const SymmetricEigen<3> eigen = symmetric_eigen(scatter);
  Eigen::Matrix3d rows;
  const double least = 1e-12 * std::max(0.0, eigen.values(2));
  for (int k = 0; k < 3; ++k) {
    const double value = eigen.values(2 - k);
    rows.row(k) = (value > least ? std::sqrt(value) : 0.0) * eigen.vectors.col(2 - k).transpose();
  }
  return rows;
}

}  // namespace lamina
