// Exact covariances of poses, planes, surfels and sensors of a refined graph.
#pragma once

#include <utility>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

struct CovarianceRequest {
  std::vector<KeyframeId> keyframes;
  std::vector<PlaneId> planes;
  std::vector<SurfelId> surfels;
  std::vector<ExtrinsicsId> extrinsics;
  bool joint_keyframes = false;                          ///< also the cross terms between keyframes
  std::vector<std::pair<PlaneId, PlaneId>> plane_pairs;  ///< with their cross terms
};

struct Covariances {
  bool valid = false;       ///< false: the information could not be factored, even damped
  int weak_directions = 0;  ///< directions nothing constrains; variances along them are huge
  std::vector<Matrix6d> keyframes;       ///< tangent (translation, rotation); zero: held
  std::vector<Eigen::Matrix3d> planes;   ///< about the anchor: (tilt, tilt, rho)
  std::vector<Eigen::Matrix3d> surfels;  ///< (height, slope.x, slope.y)
  Eigen::MatrixXd joint_keyframes;       ///< 6n x 6n when asked for
  /// 6n x 6n of the sensors asked for, in the tangent of Extrinsics; zero: held.
  Eigen::MatrixXd joint_extrinsics;
  std::vector<Matrix6d> plane_pairs;  ///< (tilt, tilt, rho) of the one, then of the other
};

/// Blocks of (J^T J)^-1 at the graph's present states, held keyframes as refine() holds them.
Covariances covariances(const Graph& graph, const CovarianceRequest& request);

/// Sets `covariance` of every active plane and every surfel.
void store_covariances(Graph& graph);

}  // namespace lamina
