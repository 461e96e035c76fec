// Saved sessions solved again, or joined into one map.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <lamina/pipeline/map_result.hpp>

namespace lamina {

/// Options of a session's text; `name` is the session's, for messages (pipeline/config).
using OptionsOfText = std::function<MapOptions(const std::string& yaml, const std::string& name)>;

/// Reads the sessions (folders of `map`, or session.lamina files), joins the second and later ones
/// to the first through planes they share, refines the whole graph and draws its grids. The options
/// are the first session's. Throws lamina::Error when a session cannot be read or shares too
/// little.
MapResult refine_sessions(const std::vector<std::filesystem::path>& inputs,
                          const OptionsOfText& options_of,
                          const std::filesystem::path& scratch_folder, RunObserver& observer);

}  // namespace lamina
