// Where rays of scans went: cells, in plan, in which nothing stands at the height of the scanner.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>

namespace lamina {

/// Squares of 10 cm of the map's x-y plane. What a plane of another map may contradict.
class FreeSpace {
 public:
  /// A ray in the map frame, from the scanner to where it was reflected.
  void add_ray(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map);

  /// At least three rays crossed the cell and none was reflected in it or beside it.
  bool free(const Eigen::Vector2d& point_map) const;
  bool empty() const { return cells_.empty(); }
  /// Mean height of the rays, m: what stands lower or hangs higher stops none of them.
  double height() const { return rays_ > 0 ? sum_z_ / rays_ : 0; }

 private:
  static constexpr double kCell = 0.1;
  struct Cell {
    std::uint16_t crossed = 0, hit = 0;
  };
  static std::int64_t key(std::int64_t i, std::int64_t j) { return i * (1LL << 31) + j; }
  static std::int64_t index(double x);

  std::unordered_map<std::int64_t, Cell> cells_;
  double rays_ = 0, sum_z_ = 0;
};

}  // namespace lamina
