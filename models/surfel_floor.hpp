// A floor of surfels: cells of a horizontal lattice, each with a height, two slopes and evidence.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include <lamina/models/moments.hpp>
#include <lamina/models/surfel.hpp>

namespace lamina {

/// One cell: z = height + slope.x (x - cx) + slope.y (y - cy), (cx, cy) the cell's centre.
struct SurfelCell {
  double height = 0;                                     ///< m, at the cell's centre
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();       ///< m per m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (height, slope.x, slope.y)
  Moments evidence;                                      ///< of the points that fell in it
  int parent_plane = -1;
};

/// Cells of one size in a frame whose z is up; several levels at one place are told apart by level.
class SurfelFloor {
 public:
  struct Key {
    std::int32_t x = 0, y = 0, level = 0;
    auto operator<=>(const Key&) const = default;
  };
  explicit SurfelFloor(double cell_size = 0.1) : cell_size_(cell_size) {}
  double cell_size() const { return cell_size_; }
  /// The cell a point of the floor falls in, at level 0.
  Key key_of(const Eigen::Vector3d& point) const;
  Eigen::Vector2d center_of(const Key& key) const;
  SurfelCell& at_or_new(const Key& key) { return cells_[key]; }
  const SurfelCell* find(const Key& key) const;
  const std::map<Key, SurfelCell>& cells() const { return cells_; }
  std::map<Key, SurfelCell>& cells() { return cells_; }
  /// The cell as a disc whose area is the cell's.
  Surfel surfel(const Key& key) const;

 private:
  double cell_size_;
  std::map<Key, SurfelCell> cells_;
};

}  // namespace lamina
