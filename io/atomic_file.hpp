// Files that appear whole or not at all.
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string_view>

namespace lamina::io {

/// Writes to a hidden file beside `file`, flushes it to the disk, then renames it over `file`: a
/// reader, or a run killed at any moment, sees the old content or the new and nothing between.
/// Throws lamina::Error naming the file when it cannot be written.
void write_atomically(const std::filesystem::path& file,
                      const std::function<void(std::ostream&)>& write);
void write_atomically(const std::filesystem::path& file, std::string_view content);

/// Creates the folder if need be; throws lamina::Error when that fails or a file stands in the way.
void make_output_folder(const std::filesystem::path& folder);
/// The same for a map: a folder that holds a recording is refused, scans.csv is a name of both.
void make_results_folder(const std::filesystem::path& folder);

}  // namespace lamina::io
