// Cells of the map, and what keyframes saw of each.
#include <lamina/backend/mapper/joint_surfels.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include <lamina/models/median.hpp>

namespace lamina {
namespace {

// What keyframes saw of one cell of one floor, in their body frames.
using Views = std::map<KeyframeId, Moments>;
using CellKey = std::pair<std::int32_t, std::int32_t>;
using Cells = std::map<CellKey, Views>;

// Active planes that face up.
std::vector<const PlaneLandmark*> ground_of(const Graph& graph) {
  std::vector<const PlaneLandmark*> ground;
  for (const PlaneLandmark& plane : graph.planes) {
    if (plane.active && plane.plane_anchor.normal().z() > 0.5) ground.push_back(&plane);
  }
  return ground;
}

// All evidence by the floor it lies on and the cell of the map, at the poses of now.
std::map<PlaneId, Cells> cells_of(const Graph& graph, const SurfelEvidence& evidence,
                                  const JointSurfelOptions& options) {
  const std::vector<const PlaneLandmark*> ground = ground_of(graph);
  std::map<PlaneId, Cells> cells;
  evidence.for_each([&](KeyframeId id, const Moments& moments_body) {
    const Keyframe* keyframe = graph.find(id);
    if (keyframe == nullptr) return;
    const Eigen::Vector3d x = keyframe->T_map_body * moments_body.mean();
    const PlaneLandmark* parent = parent_of(x, ground, options.level_gap_m);
    if (parent == nullptr) return;
    const CellKey key(static_cast<std::int32_t>(std::floor(x.x() / options.cell_m)),
                      static_cast<std::int32_t>(std::floor(x.y() / options.cell_m)));
    cells[parent->id][key][id].merge(moments_body);
  });
  return cells;
}

// Weighted mean of a cell's points in the map.
Eigen::Vector3d middle_of(const Graph& graph, const Views& views) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const auto& [id, moments] : views) {
    const Eigen::Vector3d x = graph.at(id).T_map_body * moments.mean();
    sum += moments.weight() * x.homogeneous();
  }
  return sum.head<3>() / sum(3);
}

// Root mean square of what each view shows off its own best plane: no pose has a share in it.
double roughness_of(const Cells& cells, std::size_t min_cells) {
  std::map<KeyframeId, std::vector<const Moments*>> views;
  for (const auto& [key, seen] : cells) {
    for (const auto& [id, moments] : seen) views[id].push_back(&moments);
  }
  std::vector<double> squares;
  for (const auto& [id, patches] : views) {
    if (patches.size() < min_cells) continue;
    Moments all;  // a place counts as much as any other, however near it was
    for (const Moments* m : patches) all.add(m->mean());
    const auto fit = all.fit_plane(Eigen::Vector3d::UnitZ());
    if (!fit) continue;
    for (const Moments* m : patches) {
      const double off = fit->plane.signed_distance(m->mean());
      squares.push_back(off * off);
    }
  }
  if (squares.empty()) return 0;
  // What stands on a floor has no share in a median. That of a normal distribution's squares is
  // 0.455 of their mean.
  return std::sqrt(median(squares) / 0.455);
}

struct Floor {
  const PlaneLandmark& plane;
  const Cells& cells;
  double roughness;
};

// How much of a view's weight counts.
std::map<KeyframeId, double> shares_of(const Cells& cells, double view_sigma) {
  std::map<KeyframeId, double> weights;
  for (const auto& [key, views] : cells) {
    for (const auto& [id, moments] : views) weights[id] += moments.weight();
  }
  const double most = 1 / (view_sigma * view_sigma);
  for (auto& [id, weight] : weights) weight = weight > most ? most / weight : 1.0;
  return weights;
}

SurfelLandmark surfel_at(const Graph& graph, const Floor& floor, const CellKey& key,
                         const Views& views, double cell) {
  const Plane plane_map = floor.plane.plane_map();
  Eigen::Vector3d center((key.first + 0.5) * cell, (key.second + 0.5) * cell, 0);
  const Eigen::Vector3d& n = plane_map.normal();
  center.z() = (plane_map.rho() - n.head<2>().dot(center.head<2>())) / n.z();
  SurfelLandmark surfel;
  surfel.anchor = views.begin()->first;
  surfel.T_body_cell = graph.at(surfel.anchor).T_map_body.inverse() * SE3(SO3(), center);
  surfel.radius = cell / std::sqrt(M_PI);
  surfel.state << plane_map.signed_distance(middle_of(graph, views)) / n.z(), -n.head<2>() / n.z();
  surfel.parent = floor.plane.id;
  return surfel;
}

void add_floor(Graph& graph, const Floor& floor, const JointSurfelOptions& options) {
  const auto shares = shares_of(floor.cells, options.view_sigma_m);
  const double together = std::max(1.0, options.correlation_m / options.cell_m);
  for (const auto& [key, views] : floor.cells) {
    const SurfelId id = graph.add_surfel(surfel_at(graph, floor, key, views, options.cell_m));
    for (const auto& [keyframe, moments] : views) {
      graph.surfel_moments.push_back({keyframe, id, moments.scaled(shares.at(keyframe))});
    }
    graph.surfel_parents.push_back(
        {id, floor.plane.id, together * floor.roughness, together * options.slope_sigma});
  }
}

}  // namespace

std::vector<std::string> JointSurfelOptions::problems() const {
  std::vector<std::string> result;
  const auto positive = [&result](double value, const char* name) {
    if (!(value > 0)) result.push_back(std::string(name) + ": expected more than 0");
  };
  positive(cell_m, "surfels.joint_cell_m");
  positive(least_roughness_m, "surfels.least_roughness_m");
  positive(view_sigma_m, "surfels.view_sigma_m");
  positive(correlation_m, "surfels.correlation_m");
  positive(window_every, "surfels.window_every");
  return result;
}

std::map<PlaneId, double> floor_roughness(const Graph& graph, const SurfelEvidence& evidence,
                                          const JointSurfelOptions& options) {
  std::map<PlaneId, double> roughness;
  for (const auto& [id, cells] : cells_of(graph, evidence, options)) {
    if (cells.size() < options.min_cells) continue;
    roughness[id] = roughness_of(cells, options.min_cells);
  }
  return roughness;
}

std::size_t add_joint_surfels(Graph& graph, const SurfelEvidence& evidence,
                              const JointSurfelOptions& options) {
  if (!options.enabled) return 0;
  for (const auto& [id, cells] : cells_of(graph, evidence, options)) {
    if (cells.size() < options.min_cells) continue;
    const PlaneLandmark& plane = graph.at(id);
    const double roughness = roughness_of(cells, options.min_cells);
    if (roughness < options.least_roughness_m) continue;
    add_floor(graph, {plane, cells, roughness}, options);
  }
  return graph.surfels.size();
}

void remove_surfels(Graph& graph) {
  graph.surfels.clear();
  graph.surfel_moments.clear();
  graph.surfel_parents.clear();
}

}  // namespace lamina
