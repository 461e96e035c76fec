// Fits in disparity and their way to planes and moments.
#include <lamina/frontend/depth/disparity_sums.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

DisparityGeometry DisparityGeometry::of(const DepthCamera& camera) {
  const CameraModel& c = camera.camera;
  return {c.fx, c.fy, c.cx, c.cy, camera.noise.focal_baseline};
}

DisparityPlane DisparityGeometry::disparity_plane(const Plane& plane) const {
  const Eigen::Vector3d& n = plane.normal();
  return focal_baseline / plane.rho() * Eigen::Vector3d(n.x() / fx, n.y() / fy, n.z());
}

std::optional<Plane> DisparityGeometry::plane(const DisparityPlane& p) const {
  const Eigen::Vector3d scaled = Eigen::Vector3d(p.x() * fx, p.y() * fy, p.z()) / focal_baseline;
  const double norm = scaled.norm();
  if (!std::isfinite(norm) || norm < 1e-9) return std::nullopt;
  return Plane::from_normal_rho(-scaled / norm, -1.0 / norm);
}

DisparitySums DisparitySums::shifted(double su, double sv, double sd) const {
  DisparitySums s;
  s.n = n;
  s.u = u + n * su;
  s.v = v + n * sv;
  s.d = d + n * sd;
  s.uu = uu + 2 * su * u + n * su * su;
  s.uv = uv + su * v + sv * u + n * su * sv;
  s.vv = vv + 2 * sv * v + n * sv * sv;
  s.ud = ud + su * d + sd * u + n * su * sd;
  s.vd = vd + sv * d + sd * v + n * sv * sd;
  s.dd = dd + 2 * sd * d + n * sd * sd;
  return s;
}

std::optional<DisparityPlane> DisparitySums::fit() const {
  if (n < 3) return std::nullopt;
  const double mu = u / n, mv = v / n, md = d / n;
  const double cuu = uu / n - mu * mu, cvv = vv / n - mv * mv, cuv = uv / n - mu * mv;
  const double cud = ud / n - mu * md, cvd = vd / n - mv * md;
  const double det = cuu * cvv - cuv * cuv;
  if (!(cuu > 0.1 && cvv > 0.1) || !(det > 1e-6 * cuu * cvv)) return std::nullopt;
  const double a = (cud * cvv - cvd * cuv) / det, b = (cvd * cuu - cud * cuv) / det;
  if (!std::isfinite(a) || !std::isfinite(b)) return std::nullopt;
  return DisparityPlane(a, b, md - a * mu - b * mv);
}

double DisparitySums::sse(const DisparityPlane& p) const {
  const double a = p.x(), b = p.y(), c = p.z();
  const double sum = dd + a * a * uu + b * b * vv + c * c * n +
                     2 * (a * b * uv + a * c * u + b * c * v) - 2 * (a * ud + b * vd + c * d);
  return std::max(0.0, sum);
}

double DisparitySums::mean_square(const DisparityPlane& p) const {
  if (n <= 0) return 0;
  const double a = p.x(), b = p.y(), c = p.z();
  return std::max(
      0.0, (a * a * uu + b * b * vv + c * c * n + 2 * (a * b * uv + a * c * u + b * c * v)) / n);
}

Eigen::Matrix3d DisparitySums::covariance(double variance) const {
  Eigen::Matrix3d H;
  H << uu, uv, u, uv, vv, v, u, v, n;
  // Cofactors by hand: symmetric 3x3, and this is called for every block row of growth.
  Eigen::Matrix3d C;
  C(0, 0) = H(1, 1) * H(2, 2) - H(1, 2) * H(1, 2);
  C(0, 1) = H(0, 2) * H(1, 2) - H(0, 1) * H(2, 2);
  C(0, 2) = H(0, 1) * H(1, 2) - H(0, 2) * H(1, 1);
  C(1, 1) = H(0, 0) * H(2, 2) - H(0, 2) * H(0, 2);
  C(1, 2) = H(0, 1) * H(0, 2) - H(0, 0) * H(1, 2);
  C(2, 2) = H(0, 0) * H(1, 1) - H(0, 1) * H(0, 1);
  C(1, 0) = C(0, 1);
  C(2, 0) = C(0, 2);
  C(2, 1) = C(1, 2);
  const double det = H(0, 0) * C(0, 0) + H(0, 1) * C(0, 1) + H(0, 2) * C(0, 2);
  if (!(det > 0)) return Eigen::Matrix3d::Zero();
  return C * (variance / det);
}

std::optional<Moments> DisparitySums::moments(const DisparityGeometry& g, const Plane& plane,
                                              double variance) const {
  Eigen::Matrix4d S;
  S << uu, uv, u, ud, uv, vv, v, vd, u, v, n, d, ud, vd, d, dd;
  const double fb = g.focal_baseline;
  const Eigen::Vector4d scale(fb / g.fx, fb / g.fy, fb, 1.0);
  const double weight = 1.0 / (plane.rho() * plane.rho() * variance);
  const Eigen::Matrix4d M = weight * scale.asDiagonal() * S * scale.asDiagonal();
  return Moments::from_homogeneous(M, static_cast<std::int64_t>(n));
}

}  // namespace lamina
