// Where sensors sit on the body, estimated together with the poses and planes of a graph.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lamina/backend/refine/refiner.hpp>

namespace lamina {

struct ExtrinsicsOptions {
  SolverEngine engine = SolverEngine::kNative;
  double sigma_place_m = 0.03;  ///< how well stated places are known, each axis, 1-sigma
  double sigma_turn_deg = 1.5;  ///< likewise stated directions
  /// Directions whose sigma after estimation is above this share of the prior's are not observed:
  /// along them a sensor stays as stated.
  double unobserved_share = 0.5;
  /// An estimate further from what is stated than so many prior sigmas along a direction is no
  /// error of mounting but a contradiction: it is not adopted.
  double most_sigmas = 4;
};

/// One sensor.
struct FoundExtrinsics {
  ExtrinsicsId id = ExtrinsicsId::kNone;
  std::string sensor;  ///< as calibration.yaml calls it
  SE3 stated, found;   ///< T_body_sensor; found is as stated along directions that are not observed
  /// Of log(stated^-1 T_body_sensor): (translation, rotation) in sensor axes, m and rad.
  Matrix6d covariance = Matrix6d::Zero();
  int observed = 0;  ///< directions of six; half of each that relates two sensors
  /// How much of each number (moved, turned; body axes) lies along observed directions, 0 to 1.
  Vector6d observed_share = Vector6d::Zero();
};

struct ExtrinsicsEstimate {
  std::vector<FoundExtrinsics> sensors;  ///< that saw something
  /// All six numbers of each sensor as least squares have them, stacked, with their covariance.
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;
  /// Truncated totals (an observation of no plane costs RefineOptions::inlier_chi2 and no more)
  /// with all sensors as stated and with their states free, the prior's cost in it.
  double total_stated = 0, total_free = 0;
  double price = 0;      ///< of what was freed: observed directions times ln(views)
  bool adopted = false;  ///< free is lower by more than its price, and no contradiction
};

/// Solves a refined graph twice, robustly: sensors as stated, and free with a prior about that. The
/// graph itself is not changed. nullopt without sensors, or where a solution is not finite.
std::optional<ExtrinsicsEstimate> estimate_extrinsics(const Graph& graph,
                                                      const ExtrinsicsOptions& options);

}  // namespace lamina
