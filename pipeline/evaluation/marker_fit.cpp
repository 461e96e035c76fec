// Ten numbers: alignment, lever, clock.
#include <lamina/pipeline/evaluation/marker_fit.hpp>

#include <Eigen/Dense>
#include <vector>

#include <lamina/pipeline/evaluation/trajectory_error.hpp>

namespace lamina {
namespace {

using Vector10 = Eigen::Matrix<double, 10, 1>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;

struct Pair {
  SE3 T_map_body, T_reference_marker;
  Eigen::Vector3d velocity;  // m/s of the reference
};

std::vector<Pair> pairs_of(const Trajectory& estimate, const Trajectory& reference, double clock,
                           const MarkerFitOptions& options) {
  std::vector<Pair> pairs;
  for (const StampedPose& sample : estimate) {
    const Timestamp stamp = sample.stamp + clock;
    const auto at = reference.at(stamp, options.max_gap),
               before = reference.at(stamp + -options.step_s, options.max_gap),
               after = reference.at(stamp + options.step_s, options.max_gap);
    if (at && before && after)
      pairs.push_back({sample.pose, *at,
                       (after->translation() - before->translation()) / (2 * options.step_s)});
  }
  return pairs;
}

SE3 alignment(const std::vector<Pair>& pairs, const Eigen::Vector3d& lever) {
  std::vector<Eigen::Vector3d> markers, references;
  for (const Pair& pair : pairs) {
    markers.push_back(pair.T_map_body * lever);
    references.push_back(pair.T_reference_marker.translation());
  }
  return align(references, markers);
}

// The step of lever and clock beside that of the alignment.
Vector10 step_of(const std::vector<Pair>& pairs, const MarkerFit& fit,
                 const MarkerFitOptions& options) {
  const SE3 T = alignment(pairs, fit.lever_body);
  Matrix10 normal = Matrix10::Zero();
  Vector10 gradient = Vector10::Zero();
  for (const Pair& pair : pairs) {
    const Eigen::Vector3d marker = T * (pair.T_map_body * fit.lever_body);
    Eigen::Matrix<double, 3, 10> J = Eigen::Matrix<double, 3, 10>::Zero();
    J.leftCols<3>().setIdentity();
    for (int k = 0; k < 3; ++k) J.col(3 + k) = Eigen::Vector3d::Unit(k).cross(marker);
    if (options.lever) J.middleCols<3>(6) = (T.so3() * pair.T_map_body.so3()).matrix();
    if (options.clock) J.col(9) = -pair.velocity;
    const Eigen::Vector3d residual = pair.T_reference_marker.translation() - marker;
    normal += J.transpose() * J;
    gradient += J.transpose() * residual;
  }
  // In units of each number's own effect; directions that hardly anything tells stay where they
  // are.
  Vector10 unit = normal.diagonal().cwiseSqrt();
  for (double& effect : unit) effect = effect > 0 ? 1 / effect : 0;
  const Eigen::SelfAdjointEigenSolver<Matrix10> eigen(unit.asDiagonal() * normal *
                                                      unit.asDiagonal());
  Vector10 step = Vector10::Zero();
  for (int i = 0; i < 10; ++i) {
    if (eigen.eigenvalues()[i] < options.open * eigen.eigenvalues()[9]) continue;
    const Vector10 direction = unit.cwiseProduct(eigen.eigenvectors().col(i));
    step += direction * (direction.dot(gradient) / eigen.eigenvalues()[i]);
  }
  return step;
}

}  // namespace

Trajectory MarkerFit::of_marker(const Trajectory& estimate) const {
  Trajectory moved;
  for (const StampedPose& sample : estimate)
    moved.add(sample.stamp + clock_s, SE3(sample.pose.so3(), sample.pose * lever_body));
  return moved;
}

std::optional<MarkerFit> fit_marker(const Trajectory& estimate, const Trajectory& reference,
                                    const MarkerFitOptions& options) {
  MarkerFit fit;
  for (int i = 0; i < options.iterations; ++i) {
    const auto pairs = pairs_of(estimate, reference, fit.clock_s, options);
    if (pairs.size() < options.least_pairs) return std::nullopt;
    const Vector10 step = step_of(pairs, fit, options);
    fit.lever_body += step.segment<3>(6);
    fit.clock_s += step[9];
  }
  return fit;
}

}  // namespace lamina
