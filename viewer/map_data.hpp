// A map folder's files as the JSON the page reads.
#pragma once

#include <filesystem>
#include <string>

namespace lamina::viewer {

/// ASCII text of {name, planes, trajectory, before, keyframes, metrics, evaluation, grid,
/// occupancy, surfels, points, edges, path}; what has no file is absent. Throws lamina::Error
/// naming the file at fault.
std::string map_data(const std::filesystem::path& map_folder);

}  // namespace lamina::viewer
