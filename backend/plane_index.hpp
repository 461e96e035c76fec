// Which planes are near a place: a coarse hash of space over their outlines.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <lamina/backend/graph.hpp>

namespace lamina {

/// Cubes of `cell_m`, each with the planes whose evidence touches it. Queries are answered from the
/// cubes around the points: cost grows with what is near, not with the map.
class PlaneIndex {
 public:
  explicit PlaneIndex(double cell_m = 1.5) : cell_(cell_m) {}
  double cell() const { return cell_; }
  /// The plane was seen at these points (map frame), at most a cell apart from each other.
  void insert(PlaneId plane, std::span<const Eigen::Vector3d> points_map);
  void remove(PlaneId plane);
  /// `from`'s cells belong to `into` now.
  void rename(PlaneId from, PlaneId into);
  void clear();
  /// Planes with evidence within one cell (by cubes: between 1 and 2 cell sizes) of any of the
  /// points, ids ascending.
  std::vector<PlaneId> near(std::span<const Eigen::Vector3d> points_map) const;
  /// As near(), within `cells` cubes.
  std::vector<PlaneId> near(const Eigen::Vector3d& point_map, int cells) const;
  std::size_t size() const { return cells_.size(); }

 private:
  using Key = std::array<std::int32_t, 3>;
  Key key(const Eigen::Vector3d& point) const;
  double cell_;
  std::map<Key, std::vector<PlaneId>> cells_;
};

/// Points of a polygon (closed) or stroke at most `spacing` apart: its corners, edges and, for
/// polygons, a lattice of its inside.
std::vector<Eigen::Vector3d> sample_outline(std::span<const Eigen::Vector3d> outline,
                                            double spacing);

}  // namespace lamina
