// Small maps to draw: floors of surfels, walls, plates, a path.
#pragma once

#include <lamina/grid/grid_geometry.hpp>
#include <lamina/grid/navigability_grid.hpp>
#include <lamina/models/planar_map.hpp>

namespace lamina::test {

inline NavigabilityCell at(const NavigabilityGrid& grid, double x, double y) {
  const NavigabilityCell* cell = grid.find(cell_of({x, y}, grid.resolution()));
  return cell == nullptr ? NavigabilityCell{} : *cell;
}

inline Surfel surfel_at(double x, double y, double z, const Eigen::Vector3d& normal,
                        double sigma = 0) {
  Surfel s;
  s.center = {x, y, z};
  s.normal = normal;
  s.radius = 0.1 / std::sqrt(M_PI);
  s.covariance.setZero();
  s.covariance(2, 2) = sigma * sigma;
  return s;
}

/// Squares of 0.1 m, aligned to multiples of it, with the height and slope at their centres.
template <class Height>
void add_floor(PlanarMap& map, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
               Height&& height, double sigma = 0) {
  const int i1 = static_cast<int>(std::lround(high.x() / 0.1));
  const int j1 = static_cast<int>(std::lround(high.y() / 0.1));
  for (int j = static_cast<int>(std::lround(low.y() / 0.1)); j < j1; ++j) {
    for (int i = static_cast<int>(std::lround(low.x() / 0.1)); i < i1; ++i) {
      const double x = 0.1 * i + 0.05, y = 0.1 * j + 0.05, e = 0.01;
      const Eigen::Vector3d normal(-(height(x + e, y) - height(x - e, y)) / (2 * e),
                                   -(height(x, y + e) - height(x, y - e)) / (2 * e), 1);
      map.surfels.push_back(surfel_at(x, y, height(x, y), normal.normalized(), sigma));
    }
  }
}

inline void add_plane(PlanarMap& map, const Plane& plane, std::vector<Eigen::Vector3d> outline) {
  MapPlane p;
  p.id = static_cast<std::int64_t>(map.planes.size());
  p.plane_map = plane;
  p.centroid_map.setZero();
  for (const auto& v : outline) p.centroid_map += v / static_cast<double>(outline.size());
  p.outlines_map.push_back(std::move(outline));
  map.planes.push_back(std::move(p));
}

inline void add_wall(PlanarMap& map, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                     double bottom, double top) {
  const Eigen::Vector2d d = (b - a).normalized();
  const Eigen::Vector3d normal(d.y(), -d.x(), 0), foot(a.x(), a.y(), 0);
  add_plane(
      map, Plane(normal, normal.dot(foot)),
      {{a.x(), a.y(), bottom}, {b.x(), b.y(), bottom}, {b.x(), b.y(), top}, {a.x(), a.y(), top}});
}

/// A level plate, seen from above or from below.
inline void add_plate(PlanarMap& map, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                      double z, bool from_above) {
  const double side = from_above ? 1 : -1;
  add_plane(map, Plane(Eigen::Vector3d(0, 0, side), side * z),
            {{low.x(), low.y(), z},
             {high.x(), low.y(), z},
             {high.x(), high.y(), z},
             {low.x(), high.y(), z}});
}

/// Poses every 0.1 m.
inline void add_path(PlanarMap& map, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const int n = 1 + static_cast<int>((b - a).norm() / 0.1);
  for (int k = 0; k <= n; ++k) {
    const auto t = static_cast<std::int64_t>(map.trajectory.size()) * 100'000'000;
    map.trajectory.add(Timestamp::from_nanoseconds(t),
                       SE3(SO3(), a + (b - a) * (k / static_cast<double>(n))));
  }
}

}  // namespace lamina::test
