// ATE and RPE.
#include <lamina/pipeline/evaluation/trajectory_error.hpp>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include <lamina/io/decimal_seconds.hpp>
#include <lamina/models/median.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

Eigen::Vector3d mean_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) mean += point / static_cast<double>(points.size());
  return mean;
}

struct Pair {
  Timestamp stamp;
  SE3 estimate, reference;
};

std::vector<Pair> matched_poses(const Trajectory& estimate, const Trajectory& reference,
                                double max_gap) {
  std::vector<Pair> pairs;
  for (const auto& [stamp, pose] : estimate) {
    if (const auto truth = reference.at(stamp, max_gap)) pairs.push_back({stamp, pose, *truth});
  }
  return pairs;
}

ErrorStatistics distances(const std::vector<Pair>& pairs, const SE3& T_reference_estimate) {
  std::vector<double> errors;
  for (const Pair& p : pairs) {
    errors.push_back(
        (T_reference_estimate * p.estimate.translation() - p.reference.translation()).norm());
  }
  return error_statistics(std::move(errors));
}

// Points on a line leave a turn about it open, or to millimetres of noise: attitudes tell it then.
// The turn in the reference's frame, about the middle of its path.
SE3 turn_about_line(const std::vector<Pair>& pairs, const SE3& T_reference_estimate) {
  constexpr double kStraight = 1e-4;  // squared ratio of the path's widths: 2 cm beside 2 m
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Pair& p : pairs) {
    mean += p.reference.translation() / static_cast<double>(pairs.size());
  }
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero(), turns = Eigen::Matrix3d::Zero();
  for (const Pair& p : pairs) {
    const Eigen::Vector3d d = p.reference.translation() - mean;
    scatter += d * d.transpose();
    turns +=
        (p.reference.so3() * (T_reference_estimate.so3() * p.estimate.so3()).inverse()).matrix();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(scatter, Eigen::ComputeFullU);
  if (svd.singularValues()(1) > kStraight * svd.singularValues()(0)) return SE3();
  // Over rotations R(angle) about the axis, the sum of tr(R' turn) is largest here.
  const Eigen::Vector3d axis = svd.matrixU().col(0);
  const Eigen::Vector3d skew(turns(2, 1) - turns(1, 2), turns(0, 2) - turns(2, 0),
                             turns(1, 0) - turns(0, 1));
  const double angle = std::atan2(axis.dot(skew), turns.trace() - axis.dot(turns * axis));
  const SO3 R = SO3::exp(angle * axis);
  return SE3(R, mean - R * mean);
}

void relative_errors(const std::vector<Pair>& pairs, TrajectoryError& result) {
  std::vector<double> metres, degrees;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    while (j < pairs.size() && pairs[j].stamp - pairs[i].stamp < result.rpe_interval_s) ++j;
    if (j == pairs.size()) break;
    const SE3 moved_estimate = pairs[i].estimate.inverse() * pairs[j].estimate;
    const SE3 moved_reference = pairs[i].reference.inverse() * pairs[j].reference;
    const SE3 error = moved_reference.inverse() * moved_estimate;
    metres.push_back(error.translation().norm());
    degrees.push_back(error.so3().log().norm() / kDegree);
  }
  result.rpe_m = error_statistics(std::move(metres));
  result.rpe_deg = error_statistics(std::move(degrees));
}

}  // namespace

double ErrorStatistics::deviation() const {
  return std::sqrt(std::max(0.0, rmse * rmse - mean * mean));
}

ErrorStatistics error_statistics(std::vector<double> errors) {
  ErrorStatistics s;
  s.count = static_cast<int>(errors.size());
  if (errors.empty()) return s;
  double sum = 0, squares = 0;
  for (const double e : errors) {
    sum += e;
    squares += e * e;
    s.max = std::max(s.max, e);
  }
  s.mean = sum / s.count;
  s.rmse = std::sqrt(squares / s.count);
  s.median = median(errors);
  return s;
}

SE3 align(const std::vector<Eigen::Vector3d>& points_a,
          const std::vector<Eigen::Vector3d>& points_b) {
  const Eigen::Vector3d mean_a = mean_of(points_a), mean_b = mean_of(points_b);
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    H += (points_a[i] - mean_a) * (points_b[i] - mean_b).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  const Eigen::Matrix3d R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  const SO3 so3{Eigen::Quaterniond(R)};
  return SE3(so3, mean_a - so3 * mean_b);
}

SE3 align_by_yaw(const std::vector<Eigen::Vector3d>& points_a,
                 const std::vector<Eigen::Vector3d>& points_b) {
  const Eigen::Vector3d mean_a = mean_of(points_a), mean_b = mean_of(points_b);
  double along = 0, across = 0;
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    const Eigen::Vector3d a = points_a[i] - mean_a, b = points_b[i] - mean_b;
    along += a.head<2>().dot(b.head<2>());
    across += b.x() * a.y() - b.y() * a.x();
  }
  const SO3 R = SO3::rot_z(std::atan2(across, along));
  return SE3(R, mean_a - R * mean_b);
}

std::optional<TrajectoryError> trajectory_error(const Trajectory& estimate,
                                                const Trajectory& reference, double max_gap,
                                                Alignment alignment) {
  const std::vector<Pair> pairs = matched_poses(estimate, reference, max_gap);
  if (pairs.size() < 2) return std::nullopt;
  TrajectoryError result;
  result.matched = static_cast<int>(pairs.size());
  result.estimated = static_cast<int>(estimate.size());
  std::vector<Eigen::Vector3d> points_reference, points_estimate;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    points_reference.push_back(pairs[i].reference.translation());
    points_estimate.push_back(pairs[i].estimate.translation());
    if (i > 0) result.length_m += (points_reference[i] - points_reference[i - 1]).norm();
  }
  if (alignment == Alignment::kSe3) {
    result.T_reference_estimate = align(points_reference, points_estimate);
  } else if (alignment == Alignment::kYaw) {
    result.T_reference_estimate = align_by_yaw(points_reference, points_estimate);
  }
  result.ate_m = distances(pairs, result.T_reference_estimate);
  const SE3 turn =
      alignment == Alignment::kSe3 ? turn_about_line(pairs, result.T_reference_estimate) : SE3();
  result.ate_first_m = distances(pairs, pairs.front().reference * pairs.front().estimate.inverse());
  result.ate_unaligned_m = distances(pairs, SE3());
  std::vector<double> angles, heights;
  for (const Pair& p : pairs) {
    const SE3 aligned = result.T_reference_estimate * p.estimate;
    result.times.push_back(io::decimal_seconds(p.stamp));
    const Eigen::Vector3d off = aligned.translation() - p.reference.translation();
    result.errors_m.push_back(off.norm());
    heights.push_back(std::abs(off.z()));
    angles.push_back((p.reference.so3().inverse() * (turn * aligned).so3()).log().norm() / kDegree);
  }
  result.T_reference_estimate = turn * result.T_reference_estimate;
  result.ate_deg = error_statistics(std::move(angles));
  result.ate_height_m = error_statistics(std::move(heights));
  relative_errors(pairs, result);
  return result;
}

}  // namespace lamina
