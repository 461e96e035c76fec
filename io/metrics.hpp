// metrics.json: what a run says of itself.
#pragma once

#include <filesystem>

#include <lamina/models/diagnostics.hpp>

namespace lamina::io {

/// docs/formats.md; peak memory is read from the running process.
void write_metrics(const std::filesystem::path& file, const Diagnostics& diagnostics);

}  // namespace lamina::io
