// A finished map in forms that other programs read.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lamina {

/// A form that export_map() writes.
struct ExportFormat {
  std::string name, summary;
  void (*write)(const std::filesystem::path& map, const std::filesystem::path& output);
  std::vector<std::string> files;  ///< written into the output folder
};
const std::vector<ExportFormat>& export_formats();

/// Writes the map of folder `map` (of `lamina map` or `refine`) in the form `format` into the
/// folder `output`, which is made where it is missing, and returns what was written. Throws
/// lamina::Error, one line, for a folder without a map, a damaged file, or a form that is not
/// there.
std::vector<std::filesystem::path> export_map(const std::filesystem::path& map,
                                              const std::string& format,
                                              const std::filesystem::path& output);

}  // namespace lamina
