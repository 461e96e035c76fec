// Absolute and relative trajectory error against a reference.
#pragma once

#include <optional>
#include <vector>

#include <lamina/models/trajectory.hpp>

namespace lamina {

struct ErrorStatistics {
  int count = 0;
  double rmse = 0, mean = 0, median = 0, max = 0;
  /// Standard deviation about the mean.
  double deviation() const;
};
ErrorStatistics error_statistics(std::vector<double> errors);

/// Which motion may lay the estimate on the reference: none, a turn about z and an offset, or any.
enum class Alignment { kNone, kYaw, kSe3 };

struct TrajectoryError {
  int matched = 0, estimated = 0;  ///< poses with a reference, poses at all
  ErrorStatistics ate_m;           ///< aligned over all matched poses
  ErrorStatistics ate_deg;
  ErrorStatistics ate_height_m;     ///< of it along z
  ErrorStatistics ate_first_m;      ///< with the first matched poses laid on each other
  ErrorStatistics ate_unaligned_m;  ///< as the files stand
  ErrorStatistics rpe_m, rpe_deg;   ///< over pairs `rpe_interval_s` apart
  double rpe_interval_s = 1.0;
  double length_m = 0;                  ///< of the matched reference path
  SE3 T_reference_estimate;             ///< the alignment
  std::vector<double> times, errors_m;  ///< aligned error over time
};

/// The reference is interpolated to the estimate's stamps (between samples at most `max_gap`
/// apart); [Sturm2012] defines ATE and RPE, [Umeyama1991] the alignment, here without scale. By
/// kSe3 the mirror image of a level path passes for it (a half turn about a level axis), by kYaw
/// it does not. Where the path is a line, positions leave a turn about it open: attitudes tell it
/// (ate_deg and T_reference_estimate; distances are those of the positions' alignment). nullopt
/// when fewer than two stamps meet.
std::optional<TrajectoryError> trajectory_error(const Trajectory& estimate,
                                                const Trajectory& reference, double max_gap = 0.5,
                                                Alignment alignment = Alignment::kSe3);

/// The rigid motion T_a_b that best maps points_b onto points_a; fewer than three points or points
/// on a line fix what they can.
SE3 align(const std::vector<Eigen::Vector3d>& points_a,
          const std::vector<Eigen::Vector3d>& points_b);
/// Likewise among turns about z and offsets.
SE3 align_by_yaw(const std::vector<Eigen::Vector3d>& points_a,
                 const std::vector<Eigen::Vector3d>& points_b);

}  // namespace lamina
