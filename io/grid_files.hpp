// grid/: float TIFF layers with grid.yaml; map.yaml + map.png and occupancy.yaml + occupancy.pgm.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina::io {

/// grid/grid.yaml and grid/LAYER.tiff (height, slope, navigability, confidence): float32, row 0 at
/// the largest y, NaN = unknown. Resolution and origin with full precision.
void write_grid(const std::filesystem::path& folder, const NavigabilityGrid& grid);

/// A grid as it was written: cells that are known or have a height, over the images' rectangle.
struct WrittenGrid {
  GridGeometry geometry;
  NavigabilityGrid grid;
};
/// Reads the folder back, row by row: memory goes with what is known. Throws lamina::Error naming
/// file and fault.
WrittenGrid read_grid(const std::filesystem::path& folder);

/// The grid of a map's output folder. Throws lamina::Error where the folder holds no map, too.
NavigabilityGrid read_map_grid(const std::filesystem::path& map);

/// map.yaml and map.png for map_server and nav2: mode scale, 8-bit RGBA, white is navigability 1
/// (occupancy 0); unknown is grey 128 under alpha 0. map_server of ROS 1 [MapServer] calls a cell
/// occupied by its colour before it asks for alpha, nav2's [Nav2] asks for alpha first.
void write_navigability_map(const std::filesystem::path& folder, const NavigabilityGrid& grid);

/// occupancy.yaml and occupancy.pgm: mode trinary, thresholds 0.65 / 0.196; `fill` writes a row of
/// occupancy probabilities, row 0 at the largest y, NaN = unknown (205).
void write_occupancy_map(const std::filesystem::path& folder, const GridGeometry& geometry,
                         const std::function<void(int row, float* values)>& fill);

/// keepout.yaml and .pgm, speed.yaml and .pgm: masks of nav2's costmap filters [Nav2Filters], mode
/// raw, a pixel the value of its cell in the mask's OccupancyGrid. keepout (type 0): 100 where no
/// robot may go, else 0. speed (type 1, percent of the maximum speed): navigability in percent, 1
/// to 99, of what is between never and level floor, else 0, which is no limit. What is unknown has
/// no limit either: the speed filter takes an unknown cell for a fault of the mask.
void write_filter_masks(const std::filesystem::path& folder, const NavigabilityGrid& grid);

}  // namespace lamina::io
