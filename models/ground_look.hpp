// What one depth image says of the ground before the robot, cell by cell.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace lamina {

/// A place where an image saw something else than the floor. Levelled body frame: floor is z = 0.
struct GroundMark {
  /// Something raised: where it stands. Something sunk: where the line of sight passes the floor's
  /// plane, which is not there. m.
  Eigen::Vector2f xy = Eigen::Vector2f::Zero();
  float height = 0;  ///< m against the floor beside it, nearer to it than seen by one sigma
  float sigma = 0;   ///< m of the height, 1-sigma
};

/// Cells (i, j) of x and y in the levelled body frame, j running fastest. Bits say where the image
/// saw floor and hardly anything else; marks where it saw something raised or sunk.
struct GroundLook {
  Eigen::Vector2f origin = Eigen::Vector2f::Zero();  ///< lower corner of cell (0, 0), m
  float cell_m = 0.05F;
  std::int32_t nx = 0, ny = 0;
  std::vector<std::uint8_t> floor_bits;
  std::vector<GroundMark> marks;

  bool empty() const { return floor_bits.empty() && marks.empty(); }
  void set_floor(int i, int j) {
    const std::size_t k = index(i, j);
    floor_bits[k / 8] = static_cast<std::uint8_t>(floor_bits[k / 8] | 1U << k % 8);
  }
  /// Was floor seen at this place (levelled body frame, m)? False outside.
  bool floor_at(const Eigen::Vector2d& xy) const {
    const Eigen::Vector2f c = (xy.cast<float>() - origin) / cell_m;
    if (!(c.x() >= 0 && c.y() >= 0 && c.x() < static_cast<float>(nx) &&
          c.y() < static_cast<float>(ny)))
      return false;
    const std::size_t k = index(static_cast<int>(c.x()), static_cast<int>(c.y()));
    return k / 8 < floor_bits.size() && (floor_bits[k / 8] >> k % 8 & 1U) != 0;
  }

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j);
  }
};

}  // namespace lamina
