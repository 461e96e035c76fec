// Residuals between poses and planes: moments, scan segments.
#include <cmath>

#include <lamina/backend/graph/factors/plane_moments.hpp>
#include <lamina/backend/graph/factors/segment.hpp>

namespace lamina {

PlaneMomentsTerm::PlaneMomentsTerm(const Moments& moments_body, const Eigen::Vector3d& anchor)
    : root_weight(std::sqrt(std::max(0.0, moments_body.weight()))),
      mean_body(moments_body.mean()),
      rows(scatter_root(moments_body.scatter())),
      anchor_map(anchor) {}

SegmentTerm::SegmentTerm(const SegmentFactor& f, const Eigen::Vector3d& anchor)
    : middle_body(0.5 * (f.start_body + f.end_body)),
      sqrt_information(f.sqrt_information),
      anchor_map(anchor) {
  const Eigen::Vector3d along = f.end_body - f.start_body;
  const double length = along.norm();
  direction_body = length > 1e-9 ? Eigen::Vector3d(along / length) : Eigen::Vector3d::Zero();
}

void SegmentTerm::evaluate(const PoseState& pose, const PlaneState& plane,
                           Eigen::Vector2d& residual, Jacobians* J) const {
  const Eigen::Vector3d n_body = pose.R.transpose() * plane.n;
  const Eigen::Vector3d arm = pose.R * middle_body + (pose.t - anchor_map);
  const Eigen::Vector2d error(n_body.dot(direction_body), plane.n.dot(arm) - plane.rho);
  residual = sqrt_information * error;
  if (J == nullptr) return;
  Eigen::Matrix<double, 2, 6> d_pose;
  d_pose << 0, 0, 0, direction_body.cross(n_body).transpose(), n_body.transpose(),
      middle_body.cross(n_body).transpose();
  Eigen::Matrix<double, 2, 3> d_plane;
  d_plane << (pose.R * direction_body).transpose() * plane.B, 0, arm.transpose() * plane.B, -1;
  std::get<0>(*J).noalias() = sqrt_information * d_pose;
  std::get<1>(*J).noalias() = sqrt_information * d_plane;
}

Moments moments_of(const SegmentFactor& f, std::int64_t count) {
  const SegmentTerm term(f, Eigen::Vector3d::Zero());
  const Eigen::Matrix2d A = f.sqrt_information.transpose() * f.sqrt_information;
  if (!(A(1, 1) > 0)) return {};
  const double shift = A(0, 1) / A(1, 1);
  const Eigen::Vector3d& u = term.direction_body;
  const double turn = std::max(0.0, A(0, 0) - A(0, 1) * shift);
  return Moments(A(1, 1), term.middle_body + shift * u, turn * u * u.transpose(), count);
}

Eigen::Matrix2d segment_sqrt_information(const ScanSegment& segment, const NoiseFloor& floor) {
  // s: coordinate of the middle along t = (-sin, cos). There the line lies at rho - s dtheta; the
  // plane's normal is that of the line turned round, so its distance counts the other way.
  const Eigen::Vector2d t(-std::sin(segment.theta), std::cos(segment.theta));
  const double s = t.dot(0.5 * (segment.start + segment.end));
  const double turn = t.dot(segment.end - segment.start) < 0 ? -1.0 : 1.0;
  Eigen::Matrix2d to_middle;  // (rho, theta) -> (rotation, distance at the middle)
  to_middle << 0, turn, -1, s;
  Eigen::Matrix2d C = to_middle * segment.covariance * to_middle.transpose();
  C(0, 0) += floor.sigma_tilt * floor.sigma_tilt;
  C(1, 1) += floor.sigma_rho * floor.sigma_rho;
  // Inverse Cholesky factor of the 2x2 covariance: S with S^T S = C^-1.
  const double a = std::sqrt(std::max(C(0, 0), 1e-18));
  const double b = C(1, 0) / a;
  const double d = std::sqrt(std::max(C(1, 1) - b * b, 1e-18));
  Eigen::Matrix2d S;
  S << 1 / a, 0, -b / (a * d), 1 / d;
  return S;
}

}  // namespace lamina
