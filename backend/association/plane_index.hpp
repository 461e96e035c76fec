// Which planes are near a place: a coarse hash of space over their outlines.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// Cubes of `cell_m` and of half of that, each with the planes whose evidence touches it.
/// Queries are answered from the cubes around the points: cost grows with what is near, not with
/// the map.
class PlaneIndex {
 public:
  explicit PlaneIndex(double cell_m = 1.5) : cell_(cell_m) {}
  double cell() const { return cell_; }
  double small_cell() const { return cell_ / 2; }
  /// The plane was seen at these points (map frame), at most small_cell() apart from each other.
  void insert(PlaneId plane, std::span<const Eigen::Vector3d> points_map);
  /// What was seen of the plane (map frame): a closed polygon, or the two ends of a stroke.
  void insert_outline(PlaneId plane, std::span<const Eigen::Vector3d> outline_map);
  void remove(PlaneId plane);
  /// `from`'s cells belong to `into` now.
  void rename(PlaneId from, PlaneId into);
  void clear();
  /// Planes with evidence within one cell (by cubes: between 1 and 2 cell sizes) of any of the
  /// points, ids ascending.
  std::vector<PlaneId> near(std::span<const Eigen::Vector3d> points_map) const;
  /// As near(), by the small cubes: within half a cell to a whole one. Points at most small_cell()
  /// apart.
  std::vector<PlaneId> near_close(std::span<const Eigen::Vector3d> points_map) const;
  /// As near(), within `cells` cubes.
  std::vector<PlaneId> near(const Eigen::Vector3d& point_map, int cells) const;
  std::size_t size() const { return cells_.size(); }

 private:
  enum class Size : std::int32_t { kCell, kSmall };
  using Key = std::array<std::int32_t, 4>;  // size, x, y, z
  double edge(Size size) const { return size == Size::kCell ? cell() : small_cell(); }
  Key key(const Eigen::Vector3d& point, Size size) const;
  std::vector<PlaneId> near(const Eigen::Vector3d& point, Size size, int reach) const;
  std::vector<PlaneId> near(std::span<const Eigen::Vector3d> points, Size size) const;
  void insert(PlaneId plane, std::span<const Eigen::Vector3d> points, Size size);
  double cell_;
  std::map<Key, std::vector<PlaneId>> cells_;
};

/// Points of a polygon (closed) or stroke at most `spacing` apart: its corners, edges and, for
/// polygons, a lattice of its inside.
std::vector<Eigen::Vector3d> sample_outline(std::span<const Eigen::Vector3d> outline,
                                            double spacing);

}  // namespace lamina
