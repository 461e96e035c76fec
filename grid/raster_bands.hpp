// Edges of outlines by rows of tiles: internal to the rasterizer.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina::raster {

/// The edges of a plane's outlines that pass each row of tiles: of a floor as large as the map a
/// tile asks for few of its thousands.
class OutlineBands {
 public:
  struct Edge {
    Eigen::Vector3d a, b;
  };
  /// What one outline has in a row of tiles.
  struct Piece {
    std::size_t outline = 0;
    std::vector<Edge> edges;
  };
  /// `side` of a tile, m.
  OutlineBands(const MapPlane& plane, double side);
  /// Row j of tiles, outlines ascending; edges that touch its border are in both rows.
  const std::vector<Piece>& at(std::int32_t j) const;

 private:
  std::unordered_map<std::int32_t, std::vector<Piece>> rows_;
};

/// Of the planes of a map, by index, made when first asked for. Good as long as the map stays.
class BandsOfPlanes {
 public:
  explicit BandsOfPlanes(double side) : side_(side) {}
  const OutlineBands& of(std::int32_t index, const MapPlane& plane) {
    const auto at = bands_.find(index);
    return at != bands_.end() ? at->second
                              : bands_.emplace(index, OutlineBands(plane, side_)).first->second;
  }

 private:
  double side_;
  std::unordered_map<std::int32_t, OutlineBands> bands_;
};

}  // namespace lamina::raster
