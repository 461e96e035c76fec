// `lamina refine` on saved sessions: solved again, or joined into one map.
#pragma once

#include <filesystem>
#include <vector>

namespace lamina::apps {

/// Reads the sessions (folders of `map`, or session.lamina files), joins the second and later ones
/// to the first through planes they share, refines the whole graph and writes every file of a map.
/// Throws lamina::Error when a session cannot be read or shares too little.
int refine_sessions(const std::vector<std::filesystem::path>& inputs,
                    const std::filesystem::path& output, bool quiet);

}  // namespace lamina::apps
