// A rigid motion of three freedoms.
#include <lamina/backend/parameters/mounting_covariance.hpp>

namespace lamina {

Eigen::Matrix3d by_mounting(const Eigen::Matrix3d& covariance, const SE3& T_map_first,
                            const Plane& plane_map, const Eigen::Vector3d& centroid_map) {
  const Eigen::Matrix3d R = T_map_first.so3().matrix();
  const Eigen::Vector3d up = R.col(2), n = plane_map.normal();
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
  J.block<1, 2>(2, 0) = n.transpose() * R.leftCols<2>();
  J.block<2, 1>(0, 2) = plane_map.tangent_basis().transpose() * up.cross(n);
  J(2, 2) = n.dot(up.cross(centroid_map - T_map_first.translation()));
  return J * covariance * J.transpose();
}

}  // namespace lamina
