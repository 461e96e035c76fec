// Lookup and bookkeeping of a window's states and factors.
#include <lamina/backend/solver/window/window_state.hpp>

#include <ceres/cost_function.h>

#include <algorithm>

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
  renew(surfels);
  for (Surfel& surfel : surfels) renew(surfel.views);
  renew(custom);
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

int State::find(SurfelId id) const {
  const auto found =
      std::lower_bound(surfels.begin(), surfels.end(), id,
                       [](const Surfel& s, SurfelId wanted) { return s.id < wanted; });
  if (found == surfels.end() || found->id != id) return -1;
  return static_cast<int>(found - surfels.begin());
}

int State::residuals() const {
  int rows_of_custom = 0;
  for (const Surfel& s : surfels) rows_of_custom += 3 + 4 * static_cast<int>(s.views.size());
  for (const Custom& f : custom) rows_of_custom += f.factor.cost->num_residuals();
  return rows_of_custom +
         static_cast<int>(static_cast<std::size_t>(prior.r.size()) + 6 * relative_poses.size() +
                          6 * pose_priors.size() + 2 * gravity.size() + 3 * plane_priors.size() +
                          4 * views.size());
}

bool State::goes(const Surfel& surfel, const std::vector<bool>& pose_gone,
                 const std::vector<bool>& plane_gone) const {
  const int parent = find(surfel.parent);
  if (parent >= 0 && plane_gone[static_cast<std::size_t>(parent)]) return true;
  return std::any_of(surfel.views.begin(), surfel.views.end(), [&](const SurfelView& view) {
    return pose_gone[static_cast<std::size_t>(find(view.keyframe))];
  });
}

void State::erase(const std::vector<bool>& pose_gone, const std::vector<bool>& plane_gone) {
  const auto pose = [&](KeyframeId id) { return pose_gone[static_cast<std::size_t>(find(id))]; };
  const auto plane = [&](PlaneId id) { return plane_gone[static_cast<std::size_t>(find(id))]; };
  std::erase_if(relative_poses, [&](const RelativePose& f) { return pose(f.from) || pose(f.to); });
  std::erase_if(pose_priors, [&](const PosePrior& f) { return pose(f.id); });
  std::erase_if(gravity, [&](const Gravity& f) { return pose(f.id); });
  std::erase_if(plane_priors, [&](const PlanePrior& f) { return plane(f.id); });
  std::erase_if(views, [&](const PlaneView& f) { return pose(f.keyframe) || plane(f.plane); });
  std::erase_if(surfels, [&](const Surfel& s) { return goes(s, pose_gone, plane_gone); });
  std::erase_if(custom, [&](const Custom& f) {
    return std::any_of(f.keyframes.begin(), f.keyframes.end(), pose);
  });
  const auto erase_marked = [](auto& states, const std::vector<bool>& gone) {
    std::erase_if(states, [&](const auto& state) {
      return gone[static_cast<std::size_t>(&state - states.data())];
    });
  };
  erase_marked(poses, pose_gone);
  erase_marked(planes, plane_gone);
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
