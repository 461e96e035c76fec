// What is wrong with wheels in a lawful way: told by a map that was made with them.
#pragma once

#include <optional>

#include <lamina/backend/graph.hpp>

namespace lamina {

/// Systematic errors of planar odometry over an increment that it measured as (t, yaw):
///   t_true = (1 + scale) Rz(turn / 2) t,  yaw_true = yaw + turn,
///   turn = drift |t| + turn_scale yaw.
struct WheelErrors {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();  ///< scale (1), drift (rad/m), turn_scale (1)
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  /// Chi-squared of 3 degrees of freedom: how far the errors stand out from none.
  double significance() const;
};

/// The increment as these errors correct it.
SE3 corrected(const SE3& T_from_to, const Eigen::Vector3d& errors);

/// One Gauss-Newton step of a refined graph in which scale, drift and turn scale of all its
/// odometry factors are states beside poses and planes:
///   [H  B] [dx]     [J^T r]
///   [B' C] [de] = - [j^T r]     solved for de with x eliminated,
/// B by central differences of the gradient, C and j by those of the whitened odometry residuals.
/// The errors are zero to `prior_sigma`, of which the graph's odometry was corrected by `already`:
/// what is told is what must be added to that. nullopt where the graph has no odometry, or its
/// system cannot be solved.
std::optional<WheelErrors> estimate_wheel_errors(
    const Graph& graph, const Eigen::Vector3d& prior_sigma,
    const Eigen::Vector3d& already = Eigen::Vector3d::Zero());

}  // namespace lamina
