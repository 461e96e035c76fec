// Gauss-Newton over one relative pose, planes eliminated.
#include <lamina/backend/mapper/relative_pose_from_planes.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr int kRounds = 10;
// Geman and McClure's scale, chi-squared of three degrees, comes down to this from the worst
// plane's (graduated non-convexity [Yang2020]): one that contradicts the others hardly counts.
constexpr double kScale = 3, kFiner = 4;
// A tilt that points do not tell (across a scan line) is what the graph has, give or take 3
// degrees: free, it would take up every offset of points that are not quite level, 1 / rad^2.
const double kHeld = 1 / ((3 * kDegree) * (3 * kDegree));

// What is believed of a guess: information of its tangent.
Vector6d of_guess(const SharedPlanesOptions& options) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(options.prior_m),
      Eigen::Vector3d::Constant(options.prior_deg * kDegree);
  return sigma.cwiseAbs2().cwiseInverse();
}

// What a and b saw of one plane, and a's own best plane: normal and a point on it.
struct SharedPlane {
  Moments a, b;
  Eigen::Vector3d normal_a;
  Matrix32d basis;
};

SharedPlane shared(const Moments& a, const Moments& b, const Eigen::Vector3d& expected_a) {
  SharedPlane s{a, b, expected_a, Plane::tangent_basis(expected_a)};
  for (int round = 0; round < 2; ++round) {
    const Eigen::Matrix2d H =
        s.basis.transpose() * a.scatter() * s.basis + kHeld * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d tilt = H.llt().solve(-s.basis.transpose() * (a.scatter() * s.normal_a));
    if (!tilt.allFinite()) break;
    s.normal_a = (s.normal_a + s.basis * tilt).normalized();
    s.basis = Plane::tangent_basis(s.normal_a);
  }
  return s;
}

// Half the second derivative and half the gradient of a cost of the pose, and the cost.
struct Quadratic {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0;
};

// y = (tilt, tilt, height of the plane off a's own, at a's centre; tangent of the pose). What b saw
// costs w d^2 + n^T S n, d and n seen from b; what a saw is at its minimum; least over the plane.
Quadratic cost_of(const SharedPlane& s, const SE3& T_a_b) {
  const Moments& m = s.b;
  const Eigen::Matrix3d R_b_a = T_a_b.so3().inverse().matrix();
  const Eigen::Vector3d n_b = R_b_a * s.normal_a, off = T_a_b * m.mean() - s.a.mean();
  const double d = s.normal_a.dot(off);
  Eigen::Matrix<double, 9, 1> along;
  along << s.basis.transpose() * off, -1, n_b, m.mean().cross(n_b);
  Eigen::Matrix<double, 3, 9> turn = Eigen::Matrix<double, 3, 9>::Zero();
  turn.leftCols<2>() = R_b_a * s.basis;
  turn.rightCols<3>() = SO3::hat(n_b);
  Eigen::Matrix<double, 9, 9> H = m.weight() * along * along.transpose();
  H += turn.transpose() * m.scatter() * turn;
  const Eigen::Matrix<double, 9, 1> g =
      m.weight() * d * along + turn.transpose() * (m.scatter() * n_b);
  H.topLeftCorner<2, 2>() += s.basis.transpose() * s.a.scatter() * s.basis;
  H(0, 0) += kHeld;
  H(1, 1) += kHeld;
  H(2, 2) += s.a.weight();
  const Eigen::LLT<Eigen::Matrix3d> plane(Eigen::Matrix3d(H.topLeftCorner<3, 3>()));
  const Eigen::Matrix<double, 3, 6> across = plane.solve(H.topRightCorner<3, 6>());
  const Eigen::Vector3d held = plane.solve(g.head<3>());
  return {H.bottomRightCorner<6, 6>() - H.bottomLeftCorner<6, 3>() * across,
          g.tail<6>() - H.bottomLeftCorner<6, 3>() * held,
          m.weight() * d * d + n_b.dot(m.scatter() * n_b) - g.head<3>().dot(held)};
}

std::vector<SharedPlane> shared_planes(const Graph& graph, KeyframeId a, KeyframeId b) {
  const SO3 R_a_map = graph.at(a).T_map_body.so3().inverse();
  std::vector<const PlaneMomentsFactor*> of_a;
  for (const auto& f : graph.plane_moments) {
    if (f.keyframe == a && f.moments_body.weight() > 0) of_a.push_back(&f);
  }
  std::vector<SharedPlane> planes;
  for (const auto& f : graph.plane_moments) {
    if (f.keyframe != b || !(f.moments_body.weight() > 0)) continue;
    for (const PlaneMomentsFactor* other : of_a) {
      if (other->plane != f.plane) continue;
      const Eigen::Vector3d expected = R_a_map * graph.at(f.plane).plane_anchor.normal();
      planes.push_back(shared(other->moments_body, f.moments_body, expected));
    }
  }
  return planes;
}

}  // namespace

SharedPose pose_by_shared_planes(const Graph& graph, KeyframeId a, KeyframeId b, const SE3& guess,
                                 const SharedPlanesOptions& options) {
  const std::vector<SharedPlane> planes = shared_planes(graph, a, b);
  SharedPose result;
  result.T_a_b = guess;
  result.planes = static_cast<int>(planes.size());
  const Matrix6d prior = of_guess(options).asDiagonal();
  double scale = std::numeric_limits<double>::max();  // the first round believes all
  for (int round = 0;; ++round) {
    Quadratic all;
    result.chi_squared = 0;
    for (const SharedPlane& plane : planes) {
      const Quadratic one = cost_of(plane, result.T_a_b);
      const double share = scale / (scale + one.cost);
      all.H += share * share * one.H;
      all.g += share * share * one.g;
      result.chi_squared = std::max(result.chi_squared, one.cost);
    }
    scale = std::max(kScale, (round == 0 ? result.chi_squared : scale) / kFiner);
    result.information = all.H;
    if (round == kRounds) return result;
    const Vector6d moved = (guess.inverse() * result.T_a_b).log();
    const Vector6d step = (all.H + prior).llt().solve(-(all.g + prior * moved));
    if (step.allFinite()) result.T_a_b = result.T_a_b * SE3::exp(step);
  }
}

// Height and angles are what planes and guess say of them; x and y are left to the planes.
bool tells_place(const SharedPose& pose, const SharedPlanesOptions& options) {
  const Matrix6d& H = pose.information;
  const Eigen::Matrix4d rest =
      H.bottomRightCorner<4, 4>() + Eigen::Matrix4d(of_guess(options).tail<4>().asDiagonal());
  const Eigen::Matrix2d across =
      H.topLeftCorner<2, 2>() -
      H.topRightCorner<2, 4>() * rest.llt().solve(H.bottomLeftCorner<4, 2>());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> least(across, Eigen::EigenvaluesOnly);
  return least.eigenvalues()(0) * options.prior_m * options.prior_m > 1;
}

}  // namespace lamina
