// Scan conversion of discs and outlines into a tile: internal to the rasterizer.
#pragma once

#include <lamina/grid/raster_tile.hpp>

namespace lamina::raster {

/// How far the nearest disc is from each cell, over a tile and a margin around it.
class DiscDistance {
 public:
  DiscDistance(double resolution, double reach);
  void mark(int i, int j, float height);  ///< cell relative to the tile; outside is ignored
  void spread();                          ///< chamfer distances, once all is marked
  struct Nearest {
    double distance = 0;  ///< m
    float height = 0;
  };
  Nearest at(int i, int j) const;

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>((j + margin_) * side_ + i + margin_);
  }
  double resolution_;
  int margin_, side_;
  std::vector<float> distance_, height_;  // cells
};

struct Canvas {
  Tile& tile;
  const RasterOptions& options;
  DiscDistance discs;
  std::vector<Support> supports;

  Eigen::Vector2d center(int i, int j) const {
    return center_of({tile.first.i + i, tile.first.j + j}, options.resolution);
  }
};

void draw_disc(const Surfel& surfel, std::int32_t index, Canvas& canvas);
/// Surfaces and undersides cell by cell, steep planes as what stands in a cell.
void draw_plane(const MapPlane& plane, std::int32_t index, Canvas& canvas);

}  // namespace lamina::raster
