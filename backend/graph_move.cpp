// A graph in another map frame.
#include <lamina/backend/graph.hpp>

#include <Eigen/LU>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

// Takes (tilt, tilt, rho) about the old normal to the same about the turned one: each has a tangent
// basis of its own.
Eigen::Matrix3d tangent_turn(const SO3& R, const Eigen::Vector3d& normal) {
  const Matrix32d B_new = Plane::tangent_basis(R * normal), B_old = Plane::tangent_basis(normal);
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
  M.topLeftCorner<2, 2>() = B_new.transpose() * (R.matrix() * B_old);
  return M;
}

void move_prior(MarginalPrior& prior, const SE3& T) {
  for (SE3& pose : prior.poses_linear) pose = T * pose;
  for (std::size_t k = 0; k < prior.planes.size(); ++k) {
    Plane& at = prior.planes_linear[k];
    const auto column = static_cast<Eigen::Index>(6 * prior.keyframes.size() + 3 * k);
    const Eigen::Matrix3d M = tangent_turn(T.so3(), at.normal());
    prior.sqrt_information.middleCols<3>(column) =
        (prior.sqrt_information.middleCols<3>(column) * M.transpose()).eval();
    at = Plane(T.so3() * at.normal(), at.rho());
  }
}

}  // namespace

void Graph::move(const SE3& T) {
  LAMINA_CHECK(gravity.empty());
  for (Keyframe& keyframe : keyframes) keyframe.T_map_body = T * keyframe.T_map_body;
  for (PlaneLandmark& plane : planes) {
    if (plane.covariance) {
      const Eigen::Matrix3d M = tangent_turn(T.so3(), plane.plane_anchor.normal());
      plane.covariance = M * *plane.covariance * M.transpose();
    }
    plane.anchor_map = T * plane.anchor_map;
    plane.plane_anchor = Plane(T.so3() * plane.plane_anchor.normal(), plane.plane_anchor.rho());
    plane.T_map_outline = T * plane.T_map_outline;
  }
  for (PriorFactor& prior : priors) prior.T_map_body = T * prior.T_map_body;
  for (MarginalPrior& prior : marginal_priors) move_prior(prior, T);
}

}  // namespace lamina
