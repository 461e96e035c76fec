// report.html: a map folder as one page to look at, with no network.
#pragma once

#include <filesystem>
#include <string>

namespace lamina::viewer {

/// Reads a map's output folder (docs/formats.md) and writes report.html into it, whole or not at
/// all. At least one of planes.json and trajectory.txt has to be there; every other file that is
/// missing is left out of the page. Throws lamina::Error naming a file that cannot be read.
///
/// Grids are rounded to 255 steps between a layer's least and largest value, trajectories thinned
/// to 20,000 poses, surfels to 150,000, scan points to 150,000, and grids by whole rows and columns
/// to 2 million cells and 5.5 MB; the page says where it was thinned.
void write_report(const std::filesystem::path& map_folder);

/// The same page without data, which asks the server it came from for them (live_server.hpp).
std::string live_page();

}  // namespace lamina::viewer
