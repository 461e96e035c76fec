// A graph in another map frame.
#include <lamina/backend/graph/graph.hpp>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

void move_prior(MarginalPrior& prior, const SE3& T) {
  for (SE3& pose : prior.poses_linear) pose = T * pose;
  for (std::size_t k = 0; k < prior.planes.size(); ++k) {
    Plane& at = prior.planes_linear[k];
    const auto column = static_cast<Eigen::Index>(6 * prior.keyframes.size() + 3 * k);
    const Eigen::Matrix3d M = Plane::tangent_turn(T.so3(), at.normal());
    prior.sqrt_information.middleCols<3>(column) =
        (prior.sqrt_information.middleCols<3>(column) * M.transpose()).eval();
    at = Plane(T.so3() * at.normal(), at.rho());
  }
}

}  // namespace

void Graph::move(const SE3& T) {
  LAMINA_CHECK(gravity.empty() && custom.empty());
  for (Keyframe& keyframe : keyframes) keyframe.T_map_body = T * keyframe.T_map_body;
  for (PlaneLandmark& plane : planes) {
    if (plane.covariance) {
      const Eigen::Matrix3d M = Plane::tangent_turn(T.so3(), plane.plane_anchor.normal());
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
