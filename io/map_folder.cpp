// What stands where a map should.
#include <lamina/io/map_folder.hpp>

#include <lamina/models/error.hpp>

namespace lamina::io {

void require_map_folder(const std::filesystem::path& folder) {
  std::error_code none;
  const auto there = [&](const char* name) { return std::filesystem::exists(folder / name, none); };
  const char* found = nullptr;
  if (!std::filesystem::exists(folder, none)) {
    found = "no such folder";
  } else if (!std::filesystem::is_directory(folder, none)) {
    found = "a file";
  } else if (there("planes.json") || there("trajectory.txt")) {
    return;
  } else if (there("calibration.yaml")) {
    found = "a recording (calibration.yaml) and no map of it";
  } else {
    found = "neither planes.json nor trajectory.txt";
  }
  throw Error(folder.string() + ": found " + found +
              ", expected a map's output folder, of `lamina map` or `lamina refine`");
}

}  // namespace lamina::io
