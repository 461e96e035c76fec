// grid/: float TIFF layers with grid.yaml; map.yaml + map.png and occupancy.yaml + occupancy.pgm.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina::io {

/// grid/grid.yaml and grid/LAYER.tiff (height, slope, navigability, confidence): float32, row 0 at
/// the largest y, NaN = unknown. Resolution and origin with full precision.
void write_grid(const std::filesystem::path& folder, const NavigabilityGrid& grid);

/// A grid as it was written: images over one geometry.
struct GridImages {
  GridGeometry geometry;
  std::vector<float> height, slope, navigability, confidence;
};
/// Reads the folder back; throws lamina::Error naming file and fault.
GridImages read_grid(const std::filesystem::path& folder);
NavigabilityGrid to_grid(const GridImages& images);

/// map.yaml and map.png for map_server and nav2: mode scale, 8-bit grey and alpha, alpha 0 =
/// unknown; white is navigability 1 (occupancy 0).
void write_navigability_map(const std::filesystem::path& folder, const NavigabilityGrid& grid);

/// occupancy.yaml and occupancy.pgm: mode trinary, thresholds 0.65 / 0.196; `image` holds occupancy
/// probabilities, row 0 at the largest y, NaN = unknown (205).
void write_occupancy_map(const std::filesystem::path& folder, const GridGeometry& geometry,
                         const std::vector<float>& image);

}  // namespace lamina::io
