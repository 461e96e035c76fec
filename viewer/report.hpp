// report.html: a map folder as one page to look at, with no network.
#pragma once

#include <filesystem>

namespace lamina::viewer {

/// Reads a map's output folder (docs/formats.md) and writes report.html into it, whole or not at
/// all. At least one of planes.json and trajectory.txt has to be there; every other file that is
/// missing is left out of the page. Throws lamina::Error naming a file that cannot be read.
///
/// Grids are rounded to 255 steps between a layer's least and largest value, trajectories thinned
/// to 20,000 poses, surfels to 200,000, and grids of more than 2 million cells by whole rows and
/// columns; the page says where it was thinned.
void write_report(const std::filesystem::path& map_folder);

}  // namespace lamina::viewer
