// Edges into rows.
#include <lamina/grid/raster_bands.hpp>

#include <algorithm>
#include <cmath>

namespace lamina::raster {

OutlineBands::OutlineBands(const MapPlane& plane, double side) {
  constexpr double kRounding = 1e-6;  // m
  const auto row = [side](double y) { return static_cast<std::int32_t>(std::floor(y / side)); };
  for (std::size_t outline = 0; outline < plane.outlines_map.size(); ++outline) {
    const std::vector<Eigen::Vector3d>& points = plane.outlines_map[outline];
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Edge edge{points[k], points[(k + 1) % points.size()]};
      const std::int32_t last = row(std::max(edge.a.y(), edge.b.y()) + kRounding);
      for (std::int32_t j = row(std::min(edge.a.y(), edge.b.y()) - kRounding); j <= last; ++j) {
        std::vector<Piece>& pieces = rows_[j];
        if (pieces.empty() || pieces.back().outline != outline) pieces.push_back({outline, {}});
        pieces.back().edges.push_back(edge);
      }
    }
  }
}

const std::vector<OutlineBands::Piece>& OutlineBands::at(std::int32_t j) const {
  static const std::vector<Piece> none;
  const auto found = rows_.find(j);
  return found == rows_.end() ? none : found->second;
}

}  // namespace lamina::raster
