// Odometry factors with errors, and without.
#include <lamina/backend/parameters/wheel_errors.hpp>

#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/backend/graph/factors/odometry.hpp>
#include <lamina/backend/parameters/common_mode_estimation.hpp>

namespace lamina {
namespace {

constexpr double kDelta = 1e-4;  // of an error, for differences
constexpr int kCount = WheelErrors::kCount;
using Vector = WheelErrors::Vector;
using Matrix = WheelErrors::Matrix;

Graph with_errors(const Graph& graph, const Vector& errors) {
  Graph changed = graph;
  for (OdometryFactor& f : changed.odometry) f.T_from_to = corrected(f.T_from_to, errors);
  return changed;
}

Graph with_errors_of_wheels(const Graph& graph, const Eigen::VectorXd& e) {
  return with_errors(graph, WheelErrors::of(e(0), e(1), e(2)));
}

Vector6d residual(const Graph& graph, OdometryFactor factor, const Vector& errors) {
  factor.T_from_to = corrected(factor.T_from_to, errors);
  Vector6d r;
  OdometryTerm(factor).evaluate(PoseState(graph.at(factor.from).T_map_body),
                                PoseState(graph.at(factor.to).T_map_body), r, nullptr);
  return r;
}

}  // namespace

WheelTerms wheel_terms(const Graph& graph) {
  WheelTerms sum;
  for (const OdometryFactor& f : graph.odometry) {
    Eigen::Matrix<double, 6, kCount> j;
    for (int k = 0; k < kCount; ++k) {
      const Vector d = kDelta * Vector::Unit(k);
      j.col(k) = (residual(graph, f, d) - residual(graph, f, -d)) / (2 * kDelta);
    }
    sum.C += j.transpose() * j;
    sum.g += j.transpose() * residual(graph, f, Vector::Zero());
  }
  return sum;
}

std::optional<WheelErrors> estimate_wheel_errors(const Graph& graph,
                                                 const Matrix& prior_information,
                                                 const Vector& already) {
  if (graph.odometry.empty()) return std::nullopt;
  const auto [C, g] = wheel_terms(graph);
  SharedErrorModel model;
  model.corrected = [](const Graph& of, const Eigen::VectorXd& e) { return with_errors(of, e); };
  model.C = prior_information + C;
  model.g = prior_information * already + g;
  model.delta = kDelta;
  const auto found = estimate_shared_errors(graph, model);
  if (!found) return std::nullopt;
  return WheelErrors{found->value, found->covariance};
}

MovedByWheels moved_by_wheels(const Graph& graph, const Eigen::Matrix3d& covariance) {
  MovedByWheels moved;
  const std::vector<Graph> by_each = moved_by_errors(graph, with_errors_of_wheels, 3, kDelta);
  if (by_each.empty()) return moved;
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    const SE3 T_body_map = graph.keyframes[i].T_map_body.inverse();
    Eigen::Matrix<double, 6, 3> X;
    for (int k = 0; k < 3; ++k)
      X.col(k) = (T_body_map * by_each[k].keyframes[i].T_map_body).log() / kDelta;
    moved.keyframes.emplace_back(X * covariance * X.transpose());
  }
  for (std::size_t i = 0; i < graph.planes.size(); ++i) {
    const PlaneLandmark& plane = graph.planes[i];
    if (!plane.active) continue;
    Eigen::Matrix3d X;
    for (int k = 0; k < 3; ++k)
      X.col(k) = by_each[k].planes[i].plane_anchor.boxminus(plane.plane_anchor) / kDelta;
    moved.planes[plane.id] = X * covariance * X.transpose();
  }
  return moved;
}

}  // namespace lamina
