// New planes from rejected observations.
#include <lamina/backend/consistency/split_candidates.hpp>

#include <cmath>
#include <map>

namespace lamina {
namespace {

// Best plane of several views in the map, facing as `towards`; partial views leave the fit to the
// plane they came from where they do not determine one.
std::optional<Plane> common_plane(const Moments& merged, const Eigen::Vector3d& towards) {
  const auto fit = merged.fit_plane(merged.mean() + towards, 1.0);
  if (!fit) return std::nullopt;
  return fit->plane;
}

Moments in_map(const Graph& graph, std::size_t view) {
  const auto& f = graph.plane_moments[view];
  return f.moments_body.transformed(graph.at(f.keyframe).T_map_body);
}

struct CommonPlane {
  Plane plane;
  Moments merged;
  std::vector<std::size_t> views;
};

// Views that do not fit the common plane leave one by one, the worst first; nullopt where too few
// are left.
std::optional<CommonPlane> most_common_plane(const Graph& graph, std::vector<std::size_t> views,
                                             const Eigen::Vector3d& towards,
                                             const SplitOptions& options) {
  while (views.size() >= static_cast<std::size_t>(options.min_observations)) {
    Moments merged;
    for (const std::size_t i : views) merged.merge(in_map(graph, i));
    const auto plane = common_plane(merged, towards);
    if (!plane) return std::nullopt;
    double worst = options.gate_chi_squared;
    std::size_t at = views.size();
    for (std::size_t k = 0; k < views.size(); ++k) {
      const double chi = in_map(graph, views[k]).cost(*plane);
      if (chi > worst) {
        worst = chi;
        at = k;
      }
    }
    if (at == views.size()) return CommonPlane{*plane, merged, std::move(views)};
    views.erase(views.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return std::nullopt;
}

PlaneId add_split_plane(Graph& graph, const CommonPlane& common, const LabelVotes& votes) {
  const std::vector<std::size_t>& views = common.views;
  PlaneLandmark landmark = PlaneLandmark::at(common.plane, common.merged.mean());
  landmark.observations = static_cast<std::int64_t>(views.size());
  landmark.first_seen = graph.at(graph.plane_moments[views.front()].keyframe).stamp;
  landmark.last_seen = graph.at(graph.plane_moments[views.back()].keyframe).stamp;
  landmark.votes = votes;
  const PlaneId made = graph.add_plane(std::move(landmark));
  for (const std::size_t i : views) {
    graph.plane_moments[i].plane = made;
    graph.plane_moments[i].weight = 1;
  }
  return made;
}

}  // namespace

std::vector<std::pair<PlaneId, PlaneId>> split_rejected(Graph& graph,
                                                        std::span<const FactorRef> rejected,
                                                        const SplitOptions& options) {
  std::map<PlaneId, std::vector<std::size_t>> by_plane;
  for (const FactorRef& ref : rejected) {
    if (ref.type != FactorType::kPlaneMoments || ref.index >= graph.plane_moments.size()) continue;
    by_plane[graph.plane_moments[ref.index].plane].push_back(ref.index);
  }
  std::vector<std::pair<PlaneId, PlaneId>> result;
  for (const auto& [id, indices] : by_plane) {
    const PlaneLandmark* old = graph.find(id);
    if (!old || !old->active) continue;
    const auto common = most_common_plane(graph, indices, old->plane_anchor.normal(), options);
    if (!common) continue;
    const Plane& plane = common->plane;
    if (angle_between(plane, old->plane_map()) > options.max_angle_deg * M_PI / 180) continue;
    if (options.accept && !options.accept(id, plane, common->views)) continue;
    result.emplace_back(id, add_split_plane(graph, *common, LabelVotes(old->votes)));
  }
  return result;
}

}  // namespace lamina
