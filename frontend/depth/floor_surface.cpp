// Look-ups on the floor surface.
#include <lamina/frontend/depth/floor_surface.hpp>

#include <cmath>

namespace lamina {

FloorSurface::FloorSurface(const Eigen::Vector2d& origin, double cell_m, int nx, int ny)
    : origin_(origin),
      cell_m_(cell_m),
      nx_(nx),
      ny_(ny),
      cells_(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny)) {}

std::optional<std::pair<int, int>> FloorSurface::cell_of(const Eigen::Vector2d& xy) const {
  const double x = (xy.x() - origin_.x()) / cell_m_, y = (xy.y() - origin_.y()) / cell_m_;
  if (!(x >= 0 && x < nx_ && y >= 0 && y < ny_)) return std::nullopt;
  return std::pair{static_cast<int>(x), static_cast<int>(y)};
}

std::optional<double> FloorSurface::height_at(const Eigen::Vector2d& xy) const {
  const auto cell = cell_of(xy);
  if (!cell) return std::nullopt;
  // The cell itself, then its eight neighbours: the nearest that lies on a floor plane.
  double nearest = 1e9;
  int plane = -1;
  for (int i = std::max(0, cell->first - 1); i <= std::min(nx_ - 1, cell->first + 1); ++i) {
    for (int j = std::max(0, cell->second - 1); j <= std::min(ny_ - 1, cell->second + 1); ++j) {
      const int p = at(i, j).plane;
      const bool own = i == cell->first && j == cell->second;
      const double distance = own ? -1.0 : (center(i, j) - xy).squaredNorm();
      if (p < 0 || distance >= nearest) continue;
      nearest = distance;
      plane = p;
    }
  }
  if (plane < 0) return std::nullopt;
  const Eigen::Vector3d& p = planes_[static_cast<std::size_t>(plane)];
  return p.x() * xy.x() + p.y() * xy.y() + p.z();
}

}  // namespace lamina
