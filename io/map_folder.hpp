// The folder of a map that a verb is given.
#pragma once

#include <filesystem>

namespace lamina::io {

/// Throws lamina::Error, one line, where `folder` is not there, is a file, or holds no map.
void require_map_folder(const std::filesystem::path& folder);

}  // namespace lamina::io
