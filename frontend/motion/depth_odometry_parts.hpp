// What DepthOdometry keeps while it lays one image.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include <lamina/frontend/motion/depth_odometry.hpp>

namespace lamina {

/// Of the next image, before it is looked at. Camera frame.
struct DepthOdometry::Expectation {
  SE3 T_prev_curr;
  Matrix6d covariance = Matrix6d::Zero(), information = Matrix6d::Zero();
  double dt = 0;                              ///< s since the last image
  double sigma_velocity = 0, sigma_turn = 0;  ///< m, rad: where nothing but the last motion tells
  SE3 T_going_on;                             ///< T_prev_curr if the last motion goes on
  SE3 T_body_camera;
  bool by_wheels = false;
  bool overruled = false;  ///< the image contradicts the wheels, and tells the motion without them
  bool searched = false;  ///< it was found elsewhere than by wheels: these tell no more than before
  bool left_wheels() const { return overruled || searched; }
  void widen(double sigma_translation, double sigma_rotation) {
    covariance.diagonal().head<3>().array() += sigma_translation * sigma_translation;
    covariance.diagonal().tail<3>().array() += sigma_rotation * sigma_rotation;
    information = covariance.ldlt().solve(Matrix6d::Identity());
  }
};

struct DepthOdometry::Alignment {
  SE3 T_world_camera;
  Matrix6d information = Matrix6d::Zero();  ///< of the image alone
  Vector6d pull = Vector6d::Zero();         ///< information (by the image alone - as aligned)
  int unknown = 6;
  std::vector<Vector6d> open;  ///< the unknown directions, camera tangents
  double matched = 0, rms = 0;
};

}  // namespace lamina
