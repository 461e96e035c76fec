// An oriented plane: unit normal and signed distance.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include <lamina/models/lie/se3.hpp>

namespace lamina {

using Matrix32d = Eigen::Matrix<double, 3, 2>;

/// The plane n.x = rho. `normal` is of unit length and points to the side the plane was seen from;
/// rho is signed. Spherical angles: n = (sin t cos p, sin t sin p, cos t).
class Plane {
 public:
  /// The floor: z = 0, seen from above.
  Plane() = default;
  /// Divides both by |normal|; throws lamina::Error when the normal is zero or anything not finite.
  Plane(const Eigen::Vector3d& normal, double rho);
  /// As the constructor, but nullopt where that throws.
  static std::optional<Plane> from_normal_rho(const Eigen::Vector3d& normal, double rho);
  /// Angles in radians; nullopt when anything is not finite.
  static std::optional<Plane> from_spherical(double rho, double theta, double phi);
  /// Least-squares plane, normal towards `seen_from`; nullopt for fewer than three points, points
  /// on a line, or anything not finite.
  static std::optional<Plane> from_points(std::span<const Eigen::Vector3d> points,
                                          const Eigen::Vector3d& seen_from);

  const Eigen::Vector3d& normal() const { return normal_; }
  double rho() const { return rho_; }
  double theta() const;  ///< in [0, pi], from +z
  double phi() const;    ///< in (-pi, pi]; 0 where the normal is +-z

  /// n.x - rho: positive on the side the plane was seen from.
  double signed_distance(const Eigen::Vector3d& x) const { return normal_.dot(x) - rho_; }
  Eigen::Vector3d project(const Eigen::Vector3d& x) const {
    return x - signed_distance(x) * normal_;
  }
  /// The same plane seen from its other side.
  Plane flipped() const;
  /// (n, -rho): homogeneous coordinates, so that p.[x; 1] is the signed distance.
  Eigen::Vector4d homogeneous() const;
  /// Distance to this plane from `anchor`: rho - n.anchor, i.e. rho in a frame moved to the anchor.
  double rho_at(const Eigen::Vector3d& anchor) const { return rho_ - normal_.dot(anchor); }
  /// The same plane in a frame whose origin is moved to `anchor` (axes parallel).
  Plane about(const Eigen::Vector3d& anchor) const;

  /// Two unit vectors that span the plane, right-handed with the normal (b1 x b2 = n). A
  /// deterministic function of the normal; it jumps where n.z changes its sign [Duff2017].
  Matrix32d tangent_basis() const { return tangent_basis(normal_); }
  static Matrix32d tangent_basis(const Eigen::Vector3d& normal);
  /// Takes (tilt, tilt, rho) about `normal` to the same about R * normal: each has a basis of its
  /// own. Orthogonal.
  static Eigen::Matrix3d tangent_turn(const SO3& R, const Eigen::Vector3d& normal);

  /// Moves on S^2 x R: the normal by the geodesic of basis * (d0, d1), rho by d2.
  Plane boxplus(const Eigen::Vector3d& d) const;
  /// d with other.boxplus(d) == *this; opposite normals give a tilt of pi along the first axis.
  Eigen::Vector3d boxminus(const Plane& other) const;

 private:
  Eigen::Vector3d normal_ = Eigen::Vector3d::UnitZ();
  double rho_ = 0;
};

/// The plane of frame b, in frame a: n_a = R n_b, rho_a = rho_b + n_a . t.
Plane operator*(const SE3& T_a_b, const Plane& plane_b);

/// Angle between the normals in [0, pi], exact for small angles.
double angle_between(const Plane& a, const Plane& b);

/// A right-handed frame in the plane: origin at the projection of `origin`, z along the normal,
/// x and y as tangent_basis. Returns T_plane's parent_planeframe: 2D outlines live in its x-y.
SE3 plane_frame(const Plane& plane, const Eigen::Vector3d& origin);

}  // namespace lamina
