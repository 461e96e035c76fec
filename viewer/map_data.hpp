// A map folder's files as the JSON the page reads.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace lamina::viewer {

inline constexpr std::size_t kMostPoses = 20000, kMostSurfels = 200000, kMostCells = 2000000;

/// ASCII text of {name, planes, trajectory, before, metrics, evaluation, grid, occupancy, surfels,
/// path}; what has no file is absent. Throws lamina::Error naming the file at fault.
std::string map_data(const std::filesystem::path& map_folder);

}  // namespace lamina::viewer
