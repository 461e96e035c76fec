// Surfels and floors of them.
#include <lamina/models/surfel_floor.hpp>

#include <cmath>

#include <lamina/models/checked_cast.hpp>
#include <lamina/models/error.hpp>
#include <lamina/models/plane.hpp>

namespace lamina {

double Surfel::sigma_height() const { return std::sqrt(std::max(0.0, covariance(2, 2))); }

Surfel Surfel::transformed(const SE3& T_a_b) const {
  Surfel result = *this;
  result.center = T_a_b * center;
  result.normal = T_a_b.so3() * normal;
  // The tilts are about the basis of the normal, which changes with the frame.
  const Eigen::Matrix2d turn = Plane::tangent_basis(result.normal).transpose() *
                               (T_a_b.so3().matrix() * Plane::tangent_basis(normal));
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.topLeftCorner<2, 2>() = turn;
  result.covariance = J * covariance * J.transpose();
  return result;
}

SurfelFloor::Key SurfelFloor::key_of(const Eigen::Vector3d& point) const {
  return {to_cell(point.x() / cell_size_), to_cell(point.y() / cell_size_), 0};
}

Eigen::Vector2d SurfelFloor::center_of(const Key& key) const {
  return {(key.x + 0.5) * cell_size_, (key.y + 0.5) * cell_size_};
}

const SurfelCell* SurfelFloor::find(const Key& key) const {
  const auto it = cells_.find(key);
  return it == cells_.end() ? nullptr : &it->second;
}

Surfel SurfelFloor::surfel(const Key& key) const {
  const SurfelCell* cell = find(key);
  LAMINA_CHECK(cell != nullptr);
  Surfel surfel;
  const Eigen::Vector2d center = center_of(key);
  surfel.center << center, cell->height;
  surfel.normal = Eigen::Vector3d(-cell->slope.x(), -cell->slope.y(), 1.0).normalized();
  surfel.radius = cell_size_ / std::sqrt(M_PI);
  // height along the normal = vertical height * n.z; n = (-sx, -sy, 1) n.z, so the tilt of the
  // normal along basis vector b is -b.head(2) . dslope * n.z.
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
  const Matrix32d B = Plane::tangent_basis(surfel.normal);
  J.block<2, 2>(0, 1) = -surfel.normal.z() * B.topRows<2>().transpose();
  J(2, 0) = surfel.normal.z();
  surfel.covariance = J * cell->covariance * J.transpose();
  surfel.parent_plane = cell->parent_plane;
  return surfel;
}

}  // namespace lamina
