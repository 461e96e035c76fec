// Lookup and bookkeeping of a window's states and factors.
#include <lamina/backend/solver/window/window_state.hpp>

#include <lamina/backend/graph/factors/marginal_prior.hpp>

namespace lamina::window {

void State::renew_serials() {
  const auto renew = [this](auto& factors) {
    for (auto& factor : factors) factor.serial = next_serial();
  };
  renew(relative_poses);
  renew(pose_priors);
  renew(gravity);
  renew(plane_priors);
  renew(views);
  prior.serial = next_serial();
}

int State::find(KeyframeId id) const {
  for (std::size_t i = poses.size(); i-- > 0;) {
    if (poses[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

int State::find(PlaneId id) const {
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (planes[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

int State::residuals() const {
  return static_cast<int>(static_cast<std::size_t>(prior.r.size()) + 6 * relative_poses.size() +
                          6 * pose_priors.size() + 2 * gravity.size() + 3 * plane_priors.size() +
                          4 * views.size());
}

Eigen::VectorXd State::prior_step() const {
  Eigen::VectorXd d(prior.R.cols());
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < prior.poses.size(); ++i, row += 6) {
    const PoseState& now = poses[static_cast<std::size_t>(find(prior.poses[i]))].now;
    d.segment<6>(row) = marginal_delta(prior.poses_at[i], now, nullptr);
  }
  for (std::size_t i = 0; i < prior.planes.size(); ++i, row += 3) {
    const PlaneState& now = planes[static_cast<std::size_t>(find(prior.planes[i]))].now;
    d.segment<3>(row) = now.minus(prior.planes_at[i]);
  }
  return d;
}

}  // namespace lamina::window
