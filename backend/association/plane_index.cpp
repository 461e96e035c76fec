// Coarse cubes of space and the planes in them.
#include <lamina/backend/association/plane_index.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include <lamina/models/checked_cast.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

// Beyond this many cubes a coordinate is no place of a map; also keeps the cast defined.
constexpr double kFar = 1e9;

void add_sorted(std::vector<PlaneId>& ids, PlaneId id) {
  const auto at = std::lower_bound(ids.begin(), ids.end(), id);
  if (at == ids.end() || *at != id) ids.insert(at, id);
}

}  // namespace

PlaneIndex::Key PlaneIndex::key(const Eigen::Vector3d& point, Size size) const {
  Key key{static_cast<std::int32_t>(size), 0, 0, 0};
  for (int k = 0; k < 3; ++k) {
    const double c = std::floor(point(k) / edge(size));
    key[static_cast<std::size_t>(k) + 1] = static_cast<std::int32_t>(std::clamp(c, -kFar, kFar));
  }
  return key;
}

void PlaneIndex::insert(PlaneId plane, std::span<const Eigen::Vector3d> points, Size size) {
  for (const auto& point : points) {
    if (point.allFinite()) add_sorted(cells_[key(point, size)], plane);
  }
}

void PlaneIndex::insert(PlaneId plane, std::span<const Eigen::Vector3d> points_map) {
  insert(plane, points_map, Size::kCell);
  insert(plane, points_map, Size::kSmall);
}

void PlaneIndex::insert_outline(PlaneId plane, std::span<const Eigen::Vector3d> outline_map) {
  insert(plane, sample_outline(outline_map, cell()), Size::kCell);
  insert(plane, sample_outline(outline_map, small_cell()), Size::kSmall);
}

void PlaneIndex::remove(PlaneId plane) {
  for (auto it = cells_.begin(); it != cells_.end();) {
    std::erase(it->second, plane);
    it = it->second.empty() ? cells_.erase(it) : std::next(it);
  }
}

void PlaneIndex::rename(PlaneId from, PlaneId into) {
  for (auto& [place, ids] : cells_) {
    if (std::erase(ids, from) > 0) add_sorted(ids, into);
  }
}

void PlaneIndex::clear() { cells_.clear(); }

std::vector<PlaneId> PlaneIndex::near(const Eigen::Vector3d& point, Size size, int reach) const {
  std::vector<PlaneId> result;
  if (!point.allFinite()) return result;
  const Key middle = key(point, size);
  for (std::int32_t x = -reach; x <= reach; ++x) {
    for (std::int32_t y = -reach; y <= reach; ++y) {
      for (std::int32_t z = -reach; z <= reach; ++z) {
        const auto it = cells_.find({middle[0], middle[1] + x, middle[2] + y, middle[3] + z});
        if (it == cells_.end()) continue;
        for (const PlaneId id : it->second) add_sorted(result, id);
      }
    }
  }
  return result;
}

std::vector<PlaneId> PlaneIndex::near(std::span<const Eigen::Vector3d> points, Size size) const {
  std::vector<PlaneId> result;
  std::set<Key> asked;
  for (const auto& point : points) {
    if (!point.allFinite() || !asked.insert(key(point, size)).second) continue;
    for (const PlaneId id : near(point, size, 1)) add_sorted(result, id);
  }
  return result;
}

std::vector<PlaneId> PlaneIndex::near(const Eigen::Vector3d& point_map, int cells) const {
  return near(point_map, Size::kCell, cells);
}

std::vector<PlaneId> PlaneIndex::near(std::span<const Eigen::Vector3d> points_map) const {
  return near(points_map, Size::kCell);
}

std::vector<PlaneId> PlaneIndex::near_close(std::span<const Eigen::Vector3d> points_map) const {
  return near(points_map, Size::kSmall);
}

std::vector<Eigen::Vector3d> sample_outline(std::span<const Eigen::Vector3d> outline,
                                            double spacing) {
  std::vector<Eigen::Vector3d> points;
  const std::size_t n = outline.size();
  for (const auto& p : outline) {
    if (!p.allFinite()) return points;
  }
  const std::size_t edges = n == 2 ? 1 : n;
  for (std::size_t i = 0; i < edges; ++i) {
    const Eigen::Vector3d &a = outline[i], &b = outline[(i + 1) % n];
    const int steps = to_whole(std::ceil((b - a).norm() / spacing), 1, 1000);
    for (int k = 0; k < steps; ++k) points.push_back(a + (b - a) * (double(k) / steps));
  }
  if (n == 2) points.push_back(outline[1]);
  if (n < 3) return points;
  // The inside: a lattice along two directions of the polygon's plane.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < n; ++i) {
    normal += (outline[i] - outline[0]).cross(outline[i + 1] - outline[0]);
  }
  const auto plane = Plane::from_normal_rho(normal, 0);
  if (!plane) return points;
  const Matrix32d B = plane->tangent_basis();
  std::vector<Eigen::Vector2d> flat;
  for (const auto& p : outline) flat.push_back(B.transpose() * (p - outline[0]));
  const auto polygon = Polygon::from_vertices(std::move(flat));
  if (!polygon) return points;
  const auto [low, high] = polygon->bounds();
  const Eigen::Vector2d size = high - low;
  const double step = std::max(spacing, std::max(size.x(), size.y()) / 100.0);
  for (double x = low.x() + 0.5 * step; x < high.x(); x += step) {
    for (double y = low.y() + 0.5 * step; y < high.y(); y += step) {
      const Eigen::Vector2d q(x, y);
      if (polygon->contains(q)) points.push_back(outline[0] + B * q);
    }
  }
  return points;
}

}  // namespace lamina
