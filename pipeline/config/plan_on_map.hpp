// The shortest safe path on a finished map.
#pragma once

#include <Eigen/Core>
#include <filesystem>

#include <lamina/grid/planner.hpp>

namespace lamina {

/// plan_path() on the grid of a map's output folder, for the robot of the run that made it (its
/// config.yaml), from and to in the map frame (m). Writes path.png, and path.csv where there is a
/// path. Throws lamina::Error for a folder without a map.
Plan plan_on_map(const std::filesystem::path& map, const Eigen::Vector2d& from,
                 const Eigen::Vector2d& to);

}  // namespace lamina
