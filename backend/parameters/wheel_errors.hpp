// What is wrong with wheels in a lawful way: told by a map that was made with them.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/sensors/wheel_error_model.hpp>

namespace lamina {

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
MovedByWheels moved_by_wheels(const Graph& graph, const Eigen::Matrix3d& covariance);

}  // namespace lamina
