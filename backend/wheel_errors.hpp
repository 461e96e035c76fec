// What is wrong with wheels in a lawful way: told by a map that was made with them.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include <lamina/backend/graph.hpp>

namespace lamina {

/// Systematic errors of planar odometry over an increment that it measured as (t, yaw):
///   yaw_true = yaw + turn,  turn = drift |t| + turn_scale yaw,
///   t_true = (1 + scale) Rz(turn / 2 + direction) t + (Rz(yaw_true) - I) place.
/// True increments are those of the frame in which sensors are said to sit. Its axes are turned by
/// -direction against the wheels', its origin lies at `place` from theirs, in its own axes.
struct WheelErrors {
  static constexpr int kCount = 6;
  using Vector = Eigen::Matrix<double, kCount, 1>;
  using Matrix = Eigen::Matrix<double, kCount, kCount>;
  /// scale (1), drift (rad/m), turn_scale (1), direction (rad), place (x, y; m)
  Vector value = Vector::Zero();
  Matrix covariance = Matrix::Zero();

  static Vector of(double scale, double drift, double turn_scale, double direction = 0,
                   double x = 0, double y = 0) {
    return (Vector() << scale, drift, turn_scale, direction, x, y).finished();
  }

  /// Chi-squared of 6 degrees of freedom: how far the errors stand out from none.
  double significance() const;
};

/// The increment as these errors correct it.
SE3 corrected(const SE3& T_from_to, const WheelErrors::Vector& errors);

/// What a graph's odometry factors say of the errors, its states held: j^T j and j^T r, j the
/// derivatives of the whitened residuals by central differences.
struct WheelTerms {
  WheelErrors::Matrix C = WheelErrors::Matrix::Zero();
  WheelErrors::Vector g = WheelErrors::Vector::Zero();
};
WheelTerms wheel_terms(const Graph& graph);

/// estimate_shared_errors() of a refined graph for the six errors of all its odometry factors. The
/// errors are zero with `prior_information`, of which the graph's odometry was corrected by
/// `already`: what is told is what must be added to that. nullopt where the graph has no odometry,
/// or its system cannot be solved.
std::optional<WheelErrors> estimate_wheel_errors(
    const Graph& graph, const WheelErrors::Matrix& prior_information,
    const WheelErrors::Vector& already = WheelErrors::Vector::Zero());

/// How a refined graph moves with its wheels.
struct MovedByWheels {
  std::map<PlaneId, Eigen::Matrix3d> planes;  ///< active ones, about the anchor: (tilt, tilt, rho)
  std::vector<Matrix6d> keyframes;            ///< in their order, right tangent
};

/// Covariances that wheels add to a refined graph which err by scale, drift and turn scale in all
/// its odometry factors, of covariance `doubt`, and were not corrected: X doubt X^T, X = -H^-1 B
/// how the states follow an error (SharedErrorModel's system). What the graph itself tells of the
/// errors is left aside. Empty where its system cannot be solved.
MovedByWheels moved_by_wheels(const Graph& graph, const Eigen::Matrix3d& doubt);

}  // namespace lamina
