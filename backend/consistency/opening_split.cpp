// Gaps along upright planes, in plan, against the lines along which keyframes looked.
#include <lamina/backend/consistency/opening_split.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/backend/association/line_of_sight.hpp>

namespace lamina {
namespace {

constexpr double kOpen = 0.5;  // share of a gap that was looked through

// The direction of a wall in plan and cells of its outline along it.
struct Along {
  Eigen::Vector2d direction, origin;
  explicit Along(const PlaneLandmark& plane) {
    const Eigen::Vector2d normal = plane.plane_anchor.normal().head<2>().normalized();
    direction = {-normal.y(), normal.x()};
    origin = plane.plane_map().project(plane.anchor_map).head<2>();
  }
  double operator()(const PlaneLandmark& plane, const OutlineGrid::Cell& cell) const {
    const double size = plane.outline.cell_size();
    const Eigen::Vector3d p((cell.first + 0.5) * size, (cell.second + 0.5) * size, 0);
    return direction.dot((plane.T_map_outline * p).head<2>() - origin);
  }
};

// Where on the wall's line nothing of it was seen, m along the wall.
struct Stretch {
  PlaneId plane;
  double from, to;
};

void add_gaps(const PlaneLandmark& plane, double max_gap_m, std::vector<Stretch>& stretches,
              std::vector<SightGap>& gaps) {
  const Along along(plane);
  std::vector<double> places;
  for (const auto& cell : plane.outline.cells()) places.push_back(along(plane, cell));
  std::sort(places.begin(), places.end());
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double from = places[i - 1], to = places[i];
    if (to - from <= max_gap_m + plane.outline.cell_size()) continue;
    stretches.push_back({plane.id, from, to});
    gaps.emplace_back(along.origin + from * along.direction, along.origin + to * along.direction);
  }
}

}  // namespace

std::map<PlaneId, std::vector<OutlineGrid>> walls_apart(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    double max_gap_m) {
  std::vector<Stretch> stretches;
  std::vector<SightGap> gaps;
  for (const PlaneLandmark& plane : graph.planes) {
    if (!plane.active || std::abs(plane.plane_anchor.normal().z()) > kUprightNormal) continue;
    add_gaps(plane, max_gap_m, stretches, gaps);
  }
  std::map<PlaneId, std::vector<OutlineGrid>> result;
  if (gaps.empty()) return result;
  look_through(graph, outlines, gaps);
  std::map<PlaneId, std::vector<double>> cuts;  // m along the wall, ascending
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const auto& [plane, from, to] = stretches[i];
    if (gaps[i].open() >= kOpen) cuts[plane].push_back(0.5 * (from + to));
  }
  for (const auto& [id, at] : cuts) {
    const PlaneLandmark& plane = graph.at(id);
    const Along along(plane);
    auto& walls = result[id];
    walls.resize(at.size() + 1, OutlineGrid(plane.outline.cell_size()));
    for (const auto& cell : plane.outline.cells()) {
      const auto k = std::upper_bound(at.begin(), at.end(), along(plane, cell)) - at.begin();
      walls[static_cast<std::size_t>(k)].add_cell(cell);
    }
  }
  return result;
}

}  // namespace lamina
