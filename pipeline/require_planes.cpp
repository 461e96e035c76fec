// Causes in one line.
#include <lamina/pipeline/require_planes.hpp>

#include <fmt/format.h>

#include <lamina/models/error.hpp>

namespace lamina {

void require_planes(const MapResult& result) {
  const Diagnostics& diagnostics = result.diagnostics();
  if (!result.map.planes.empty()) return;
  std::string causes, more;
  for (const Warning& warning : diagnostics.warnings) {
    if (causes.empty()) {
      causes = "; " + warning.text;
    } else {
      more += (more.empty() ? "; also: " : ", ") + warning.id;
    }
  }
  throw Error(fmt::format(
      "{}: found no plane in {:.0f} frames and scans ({}{}{}), expected walls or floor that "
      "several of them see; the files written hold none",
      result.recording, static_cast<double>(diagnostics.counts.steps), skipped_text(diagnostics),
      causes, more));
}

}  // namespace lamina
