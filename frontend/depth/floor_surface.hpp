// The floor as a surface over ground cells: several levels and ramps, with their uncertainty.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace lamina {

/// What one ground cell holds. Heights in m along body z.
struct GroundCell {
  float height = std::numeric_limits<float>::quiet_NaN();  ///< measured surface, mean; NaN: unseen
  float sigma = 0;  ///< m, standard error of `height` against the floor beside it
  float residual =
      std::numeric_limits<float>::quiet_NaN();  ///< m above the floor refitted beside it
  float information = 0;      ///< 1/m^2 of `residual`, independent noise; 0: no evidence
  float shared_variance = 0;  ///< m^2 of `residual` that neighbouring cells share
  float top = std::numeric_limits<float>::quiet_NaN();  ///< highest surface met in the cell
  std::int32_t pixels = 0;
  std::int16_t plane =
      -1;  ///< index of the floor plane (dominant, level or ramp) it lies on, -1: none
};

/// A lattice of square cells in the levelled body frame of one frame: cell (i, j) covers
/// origin + [i, i+1) x [j, j+1) * cell_m. Row-major in i (x, forward), then j (y, left).
class FloorSurface {
 public:
  FloorSurface() = default;
  FloorSurface(const Eigen::Vector2d& origin, double cell_m, int nx, int ny);

  bool empty() const { return cells_.empty(); }
  double cell_m() const { return cell_m_; }
  int nx() const { return nx_; }
  int ny() const { return ny_; }
  const Eigen::Vector2d& origin() const { return origin_; }
  const std::vector<GroundCell>& cells() const { return cells_; }
  GroundCell& at(int i, int j) { return cells_[index(i, j)]; }
  const GroundCell& at(int i, int j) const { return cells_[index(i, j)]; }
  Eigen::Vector2d center(int i, int j) const {
    return origin_ + cell_m_ * Eigen::Vector2d(i + 0.5, j + 0.5);
  }
  /// The cell a point falls in; nullopt outside the lattice.
  std::optional<std::pair<int, int>> cell_of(const Eigen::Vector2d& xy_body) const;

  /// Coefficients (sx, sy, h0) of floor plane k: z = sx x + sy y + h0 in the body frame.
  void add_plane(const Eigen::Vector3d& coefficients) { planes_.push_back(coefficients); }
  const std::vector<Eigen::Vector3d>& planes() const { return planes_; }

  /// Height (m, body z) of the floor surface at a place: that of the plane its cell lies on.
  /// nullopt where no floor was seen (within one cell of the place).
  std::optional<double> height_at(const Eigen::Vector2d& xy_body) const;
  /// As height_at; where no floor was seen, the dominant floor carried on (0 in this frame).
  double height_or_dominant(const Eigen::Vector2d& xy_body) const {
    return height_at(xy_body).value_or(0.0);
  }

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(ny_) +
           static_cast<std::size_t>(j);
  }
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double cell_m_ = 0.05;
  int nx_ = 0, ny_ = 0;
  std::vector<GroundCell> cells_;
  std::vector<Eigen::Vector3d> planes_;
};

}  // namespace lamina
