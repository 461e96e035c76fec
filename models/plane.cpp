// Planes on S^2 x R.
#include <lamina/models/plane.hpp>

#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/models/moments.hpp>

namespace lamina {

namespace {
// Also where the squares overflow.
double length_of(const Eigen::Vector3d& v) {
  const double norm = v.norm();
  return std::isinf(norm) ? v.stableNorm() : norm;
}
}  // namespace

Plane::Plane(const Eigen::Vector3d& normal, double rho) {
  const double norm = length_of(normal);
  if (!std::isfinite(norm) || norm < 1e-12 || !std::isfinite(rho)) {
    throw Error("plane: found a zero or non-finite normal or distance, expected |normal| > 0");
  }
  // Unit to rounding already: kept as it is, so that what was written reads back bit for bit.
  const bool unit = std::abs(norm - 1.0) < 1e-15;
  normal_ = unit ? normal : Eigen::Vector3d(normal / norm);
  rho_ = unit ? rho : rho / norm;
}

std::optional<Plane> Plane::from_normal_rho(const Eigen::Vector3d& normal, double rho) {
  const double norm = length_of(normal);
  if (!std::isfinite(norm) || norm < 1e-12 || !std::isfinite(rho)) return std::nullopt;
  return Plane(normal, rho);
}

std::optional<Plane> Plane::from_spherical(double rho, double theta, double phi) {
  return from_normal_rho(
      {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)}, rho);
}

std::optional<Plane> Plane::from_points(std::span<const Eigen::Vector3d> points,
                                        const Eigen::Vector3d& seen_from) {
  Moments moments;
  for (const auto& point : points) moments.add(point);
  const auto fit = moments.fit_plane(seen_from);
  if (!fit) return std::nullopt;
  return fit->plane;
}

double Plane::theta() const { return std::atan2(normal_.head<2>().norm(), normal_.z()); }

double Plane::phi() const {
  if (normal_.x() == 0 && normal_.y() == 0) return 0;
  const double phi = std::atan2(normal_.y(), normal_.x());
  return phi <= -M_PI ? M_PI : phi;
}

Plane Plane::flipped() const { return Plane(-normal_, -rho_); }

Eigen::Vector4d Plane::homogeneous() const {
  return {normal_.x(), normal_.y(), normal_.z(), -rho_};
}

Plane Plane::about(const Eigen::Vector3d& anchor) const { return Plane(normal_, rho_at(anchor)); }

Matrix32d Plane::tangent_basis(const Eigen::Vector3d& n) {
  // [Duff2017]: an orthonormal basis without branches or loss of digits.
  const double sign = std::copysign(1.0, n.z());
  const double a = -1.0 / (sign + n.z());
  const double b = n.x() * n.y() * a;
  Matrix32d B;
  B.col(0) << 1.0 + sign * n.x() * n.x() * a, sign * b, -sign * n.x();
  B.col(1) << b, sign + n.y() * n.y() * a, -n.y();
  return B;
}

Eigen::Matrix3d Plane::tangent_turn(const SO3& R, const Eigen::Vector3d& normal) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
  M.topLeftCorner<2, 2>() =
      tangent_basis(R * normal).transpose() * (R.matrix() * tangent_basis(normal));
  return M;
}

Plane Plane::boxplus(const Eigen::Vector3d& d) const {
  const double angle = d.head<2>().norm();
  const double sinc = angle < 1e-8 ? 1.0 - angle * angle / 6.0 : std::sin(angle) / angle;
  const Eigen::Vector3d n =
      std::cos(angle) * normal_ + sinc * (tangent_basis(normal_) * d.head<2>());
  Plane result;
  result.normal_ = n.normalized();
  result.rho_ = rho_ + d.z();
  return result;
}

Eigen::Vector3d Plane::boxminus(const Plane& other) const {
  const Matrix32d B = tangent_basis(other.normal_);
  const Eigen::Vector2d s = B.transpose() * normal_;
  const double sine = s.norm();
  const double cosine = other.normal_.dot(normal_);
  Eigen::Vector3d d;
  if (sine < 1e-300) {
    d.head<2>() = cosine > 0 ? Eigen::Vector2d::Zero().eval() : Eigen::Vector2d(M_PI, 0);
  } else {
    d.head<2>() = (std::atan2(sine, cosine) / sine) * s;
  }
  d.z() = rho_ - other.rho_;
  return d;
}

Plane operator*(const SE3& T_a_b, const Plane& plane_b) {
  const Eigen::Vector3d n_a = T_a_b.so3() * plane_b.normal();
  return Plane(n_a, plane_b.rho() + n_a.dot(T_a_b.translation()));
}

double angle_between(const Plane& a, const Plane& b) {
  return std::atan2(a.normal().cross(b.normal()).norm(), a.normal().dot(b.normal()));
}

SE3 plane_frame(const Plane& plane, const Eigen::Vector3d& origin) {
  Eigen::Matrix3d R;
  R.leftCols<2>() = plane.tangent_basis();
  R.col(2) = plane.normal();
  return SE3(SO3(Eigen::Quaterniond(R)), plane.project(origin));
}

}  // namespace lamina
