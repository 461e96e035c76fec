// Gaps along upright planes, in plan, against the lines along which keyframes looked.
#include <lamina/backend/plane_parts.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

#include <lamina/backend/plane_index.hpp>

namespace lamina {
namespace {

constexpr double kUpright = 0.3;    // |n.z| of a wall at most
constexpr double kOpen = 0.5;       // share of a gap that was looked through
constexpr double kBin = 0.1;        // m, along a gap
constexpr double kSpacing = 0.3;    // m, of points that were seen
constexpr int kLines = 2;           // through a bin that is open
constexpr double kBefore = 0.3;     // m: what was seen is not looked through
constexpr double kFarthest = 30;    // m from the keyframe: sight lines of interest
constexpr double kLongestStep = 2;  // m between keyframes: further apart, the way is not known

// A stretch of a wall's line, in plan, where nothing of it was seen.
struct Gap {
  PlaneId plane;
  double from, to;  // m along the wall
  Eigen::Vector2d a, b;
  std::vector<int> lines;  // through each bin

  double open() const {
    const auto n = std::count_if(lines.begin(), lines.end(), [](int k) { return k >= kLines; });
    return static_cast<double>(n) / static_cast<double>(lines.size());
  }
};

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

std::vector<Gap> gaps_of(const PlaneLandmark& plane, double max_gap_m) {
  const Along along(plane);
  std::vector<double> places;
  for (const auto& cell : plane.outline.cells()) places.push_back(along(plane, cell));
  std::sort(places.begin(), places.end());
  std::vector<Gap> gaps;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double from = places[i - 1], to = places[i];
    if (to - from <= max_gap_m + plane.outline.cell_size()) continue;
    const auto at = [&along](double s) -> Eigen::Vector2d {
      return along.origin + s * along.direction;
    };
    gaps.push_back({plane.id, from, to, at(from), at(to),
                    std::vector<int>(static_cast<std::size_t>(std::ceil((to - from) / kBin)))});
  }
  return gaps;
}

// Where along a -> b the line from -> to crosses it, 0 to 1.
std::optional<double> crossing(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                               const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const auto cross = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
    return u.x() * v.y() - u.y() * v.x();
  };
  const Eigen::Vector2d gap = b - a, line = to - from;
  const double d = cross(gap, line);
  if (std::abs(d) < 1e-9) return std::nullopt;
  const double along_gap = cross(from - a, line) / d, along_line = cross(from - a, gap) / d;
  if (along_gap < 0 || along_gap >= 1 || along_line < 0 || along_line > 1) return std::nullopt;
  return along_gap;
}

class Looks {
 public:
  explicit Looks(std::vector<Gap>& gaps) : gaps_(gaps) {}

  // Gaps that a keyframe here may look through.
  void stand(const Eigen::Vector2d& from) {
    from_ = from;
    near_.clear();
    for (Gap& gap : gaps_) {
      if ((0.5 * (gap.a + gap.b) - from).norm() < kFarthest) near_.push_back(&gap);
    }
  }
  void through(const Eigen::Vector2d& to, int lines = 1) {
    for (Gap* gap : near_) {
      const auto at = crossing(gap->a, gap->b, from_, to);
      if (!at) continue;
      const auto n = static_cast<double>(gap->lines.size());
      gap->lines[static_cast<std::size_t>(*at * n)] += lines;
    }
  }
  void at(const Eigen::Vector2d& seen) {
    const double length = (seen - from_).norm();
    if (length > kBefore) through(from_ + (1 - kBefore / length) * (seen - from_));
  }

 private:
  std::vector<Gap>& gaps_;
  std::vector<Gap*> near_;
  Eigen::Vector2d from_ = Eigen::Vector2d::Zero();
};

void look(const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
          std::vector<Gap>& gaps) {
  std::map<KeyframeId, std::vector<Eigen::Vector2d>> seen;
  for (const auto& [id, pieces] : outlines) {
    const PlaneLandmark* plane = graph.find(id);
    if (!plane || !plane->active || std::abs(plane->plane_anchor.normal().z()) > kUpright) continue;
    for (const OutlinePiece& piece : pieces) {
      const Keyframe* keyframe = graph.find(piece.keyframe);
      if (!keyframe) continue;
      for (const auto& p : sample_outline(piece.points_body, kSpacing)) {
        seen[piece.keyframe].push_back((keyframe->T_map_body * p).head<2>());
      }
    }
  }
  Looks looks(gaps);
  const Keyframe* last = nullptr;
  for (const Keyframe& keyframe : graph.keyframes) {
    const Eigen::Vector2d here = keyframe.T_map_body.translation().head<2>();
    looks.stand(here);
    const auto points = seen.find(keyframe.id);
    if (points != seen.end()) {
      for (const auto& p : points->second) looks.at(p);
    }
    if (last) {
      const Eigen::Vector2d there = last->T_map_body.translation().head<2>();
      if ((here - there).norm() < kLongestStep) looks.through(there, kLines);
    }
    last = &keyframe;
  }
}

}  // namespace

std::map<PlaneId, std::vector<OutlineGrid>> walls_apart(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    double max_gap_m) {
  std::vector<Gap> gaps;
  for (const PlaneLandmark& plane : graph.planes) {
    if (!plane.active || std::abs(plane.plane_anchor.normal().z()) > kUpright) continue;
    for (Gap& gap : gaps_of(plane, max_gap_m)) gaps.push_back(std::move(gap));
  }
  std::map<PlaneId, std::vector<OutlineGrid>> result;
  if (gaps.empty()) return result;
  look(graph, outlines, gaps);
  std::map<PlaneId, std::vector<double>> cuts;  // m along the wall, ascending
  for (const Gap& gap : gaps) {
    if (gap.open() >= kOpen) cuts[gap.plane].push_back(0.5 * (gap.from + gap.to));
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
