// The results folder: docs/formats.md.
#pragma once

#include <filesystem>
#include <string>

#include <lamina/pipeline/map_result.hpp>

namespace lamina {

struct WrittenResults {
  std::string summary;  ///< a line for each file
  bool whole = true;    ///< false: some were left out, as there was no time
};

/// Writes every file of the contract but report.html; each appears whole or not at all, and what an
/// earlier run left of those that are not written is removed. Throws lamina::Error where the folder
/// cannot be written. Where all of them were, the run's checkpoint goes.
WrittenResults write_results(const std::filesystem::path& folder, const MapResult& result,
                             const RunObserver& observer = RunObserver());

/// trajectory.txt and the files of planes, surfels and graph alone.
void write_path(const std::filesystem::path& folder, const MapResult& result);

}  // namespace lamina
