// The bordered system, by the graph's own normal equations.
#include <lamina/backend/wheel_errors.hpp>

#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/backend/factors/odometry.hpp>
#include <lamina/backend/normal_equations.hpp>

namespace lamina {
namespace {

constexpr double kDelta = 1e-4;  // of an error, for differences
constexpr int kCount = WheelErrors::kCount;
using Vector = WheelErrors::Vector;
using Matrix = WheelErrors::Matrix;
constexpr double kDamping = 1e-9;  // relative: directions that nothing tells stay put

Graph with_errors(const Graph& graph, const Vector& errors) {
  Graph changed = graph;
  for (OdometryFactor& f : changed.odometry) f.T_from_to = corrected(f.T_from_to, errors);
  return changed;
}

Eigen::VectorXd gradient_with(const Graph& graph, const Vector& errors) {
  NormalEquations equations(with_errors(graph, errors));
  equations.linearize();
  return equations.gradient();
}

Vector6d residual(const Graph& graph, OdometryFactor factor, const Vector& errors) {
  factor.T_from_to = corrected(factor.T_from_to, errors);
  Vector6d r;
  OdometryTerm(factor).evaluate(PoseState(graph.at(factor.from).T_map_body),
                                PoseState(graph.at(factor.to).T_map_body), r, nullptr);
  return r;
}

}  // namespace

SE3 corrected(const SE3& T_from_to, const WheelErrors::Vector& errors) {
  const Eigen::Vector3d& t = T_from_to.translation();
  const double turn = errors(1) * t.norm() + errors(2) * T_from_to.so3().yaw();
  const SO3 R = SO3::rot_z(turn) * T_from_to.so3();
  const Eigen::Vector3d place(errors(4), errors(5), 0);
  return {R, (1 + errors(0)) * (SO3::rot_z(turn / 2 + errors(3)) * t) + (R * place - place)};
}

double WheelErrors::significance() const { return value.dot(covariance.ldlt().solve(value)); }

std::optional<WheelErrors> estimate_wheel_errors(const Graph& graph,
                                                 const Matrix& prior_information,
                                                 const Vector& already) {
  if (graph.odometry.empty()) return std::nullopt;
  NormalEquations equations(graph);
  if (equations.dimension() == 0) return std::nullopt;
  equations.linearize();
  Eigen::VectorXd damping = kDamping * equations.diagonal();
  for (double& d : damping) d = std::max(d, 1e-12);
  if (!equations.factorize(damping)) return std::nullopt;

  Eigen::MatrixXd B(equations.dimension(), kCount), H_inverse_B(equations.dimension(), kCount);
  for (int k = 0; k < kCount; ++k) {
    const Vector d = kDelta * Vector::Unit(k);
    B.col(k) = (gradient_with(graph, d) - gradient_with(graph, -d)) / (2 * kDelta);
    H_inverse_B.col(k) = equations.solve(B.col(k));
  }
  Matrix C = prior_information;
  Vector g = prior_information * already;
  for (const OdometryFactor& f : graph.odometry) {
    Eigen::Matrix<double, 6, kCount> j;
    for (int k = 0; k < kCount; ++k) {
      const Vector d = kDelta * Vector::Unit(k);
      j.col(k) = (residual(graph, f, d) - residual(graph, f, -d)) / (2 * kDelta);
    }
    C += j.transpose() * j;
    g += j.transpose() * residual(graph, f, Vector::Zero());
  }
  const Matrix S = C - B.transpose() * H_inverse_B;
  const Eigen::LLT<Matrix> llt(0.5 * (S + S.transpose()));
  if (llt.info() != Eigen::Success) return std::nullopt;
  WheelErrors result;
  result.value = -llt.solve(g - H_inverse_B.transpose() * equations.gradient());
  result.covariance = llt.solve(Matrix::Identity());
  if (!result.value.allFinite() || !result.covariance.allFinite()) return std::nullopt;
  return result;
}

}  // namespace lamina
