// New planes from rejected observations.
#include <lamina/backend/plane_split.hpp>

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
    const Eigen::Vector3d towards = old->plane_anchor.normal();
    const auto in_map = [&](std::size_t i) {
      const auto& f = graph.plane_moments[i];
      return f.moments_body.transformed(graph.at(f.keyframe).T_map_body);
    };
    // Views that do not fit the common plane leave one by one, the worst first.
    std::vector<std::size_t> views = indices;
    std::optional<Plane> plane;
    Moments merged;
    while (views.size() >= static_cast<std::size_t>(options.min_observations)) {
      merged = Moments();
      for (const std::size_t i : views) merged.merge(in_map(i));
      plane = common_plane(merged, towards);
      if (!plane) break;
      double worst = options.gate_chi_squared;
      std::size_t at = views.size();
      for (std::size_t k = 0; k < views.size(); ++k) {
        const double chi = in_map(views[k]).cost(*plane);
        if (chi > worst) {
          worst = chi;
          at = k;
        }
      }
      if (at == views.size()) break;
      views.erase(views.begin() + static_cast<std::ptrdiff_t>(at));
      plane.reset();
    }
    if (!plane || views.size() < static_cast<std::size_t>(options.min_observations)) continue;
    if (angle_between(*plane, old->plane_map()) > options.max_angle_deg * M_PI / 180) continue;
    if (options.accept && !options.accept(id, *plane, views)) continue;
    PlaneLandmark landmark = PlaneLandmark::at(*plane, merged.mean());
    landmark.observations = static_cast<std::int64_t>(views.size());
    landmark.first_seen = graph.at(graph.plane_moments[views.front()].keyframe).stamp;
    landmark.last_seen = graph.at(graph.plane_moments[views.back()].keyframe).stamp;
    landmark.votes = old->votes;
    const PlaneId made = graph.add_plane(std::move(landmark));
    for (const std::size_t i : views) {
      graph.plane_moments[i].plane = made;
      graph.plane_moments[i].weight = 1;
    }
    result.emplace_back(id, made);
  }
  return result;
}

}  // namespace lamina
