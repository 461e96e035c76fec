// What is wrong with wheels in a lawful way: told by a map that was made with them.
#pragma once

#include <optional>

#include <lamina/backend/graph.hpp>

namespace lamina {

/// Systematic errors of planar odometry over an increment that it measured as (t, yaw):
///   t_true = (1 + scale) Rz(turn / 2 + direction) t,  yaw_true = yaw + turn,
///   turn = drift |t| + turn_scale yaw.
/// `direction` is that of travel in the frame in which sensors are said to sit: their common
/// heading is off by it the other way round.
struct WheelErrors {
  /// scale (1), drift (rad/m), turn_scale (1), direction (rad)
  Eigen::Vector4d value = Eigen::Vector4d::Zero();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();

  /// Chi-squared of 4 degrees of freedom: how far the errors stand out from none.
  double significance() const;
};

/// The increment as these errors correct it.
SE3 corrected(const SE3& T_from_to, const Eigen::Vector4d& errors);

/// One Gauss-Newton step of a refined graph in which the four errors of all its
/// odometry factors are states beside poses and planes:
///   [H  B] [dx]     [J^T r]
///   [B' C] [de] = - [j^T r]     solved for de with x eliminated,
/// B by central differences of the gradient, C and j by those of the whitened odometry residuals.
/// The errors are zero to `prior_sigma`, of which the graph's odometry was corrected by `already`:
/// what is told is what must be added to that. nullopt where the graph has no odometry, or its
/// system cannot be solved.
std::optional<WheelErrors> estimate_wheel_errors(
    const Graph& graph, const Eigen::Vector4d& prior_sigma,
    const Eigen::Vector4d& already = Eigen::Vector4d::Zero());

}  // namespace lamina
