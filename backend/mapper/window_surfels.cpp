// Cells of the window's rough floors.
#include <lamina/backend/mapper/window_surfels.hpp>

#include <cmath>
#include <vector>

namespace lamina {

SurfelId WindowSurfels::surfel_at(WorkingMap& map, const Cell& cell, const PlaneLandmark& parent) {
  const auto known = surfels_.find(cell);
  if (known != surfels_.end() && map.window.contains(known->second)) return known->second;
  const JointSurfelOptions& options = map.options.joint_surfels;
  const Plane plane_map = parent.plane_map();
  const Eigen::Vector3d& n = plane_map.normal();
  Eigen::Vector3d center(cell.first + 0.5, cell.second + 0.5, 0);
  center *= options.cell_m;
  center.z() = (plane_map.rho() - n.head<2>().dot(center.head<2>())) / n.z();
  const SurfelId id = SurfelId(next_++);
  const double together = std::max(1.0, options.correlation_m / options.cell_m);
  const SurfelParentFactor tie{id, parent.id, together * map.ground.roughness(),
                               together * options.slope_sigma};
  if (!map.window.add_surfel(id, SE3(SO3(), center), tie)) return SurfelId::kNone;
  surfels_[cell] = id;
  return id;
}

void WindowSurfels::add(WorkingMap& map, std::span<const Moments> patches_body) {
  const JointSurfelOptions& options = map.options.joint_surfels;
  if (!options.enabled || !map.ground.swells()) return;
  if (keyframe_ != map.keyframe) seen_.clear();
  keyframe_ = map.keyframe;
  std::vector<const PlaneLandmark*> floors;
  for (const PlaneId id : map.window.planes()) {
    const PlaneLandmark& plane = map.graph.at(id);
    if (plane.votes.floor > 0 && plane.plane_anchor.normal().z() > 0.5) floors.push_back(&plane);
  }
  for (const Moments& patch : patches_body) {
    const Eigen::Vector3d x = map.T_map_keyframe() * patch.mean();
    const PlaneLandmark* parent = parent_of(x, floors, options.level_gap_m);
    if (parent == nullptr) continue;
    const Cell cell(static_cast<std::int32_t>(std::floor(x.x() / options.cell_m)),
                    static_cast<std::int32_t>(std::floor(x.y() / options.cell_m)));
    if (cell.first % options.window_every != 0 || cell.second % options.window_every != 0) continue;
    const SurfelId id = surfel_at(map, cell, *parent);
    if (id != SurfelId::kNone) seen_[id].merge(patch);
  }
  double weight = 0;
  for (const auto& [id, moments] : seen_) weight += moments.weight();
  const double most = 1 / (options.view_sigma_m * options.view_sigma_m);
  const double share = weight > most ? most / weight : 1;
  for (const auto& [id, moments] : seen_) map.window.set({keyframe_, id, moments.scaled(share)});
}

void WindowSurfels::forget() {
  surfels_.clear();
  seen_.clear();
}

}  // namespace lamina
