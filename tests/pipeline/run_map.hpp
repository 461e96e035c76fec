// A recording mapped and written, as the program does it.
#pragma once

#include <lamina/io/atomic_file.hpp>
#include <lamina/pipeline/config/map_request.hpp>
#include <lamina/pipeline/map.hpp>
#include <lamina/pipeline/write_results.hpp>

namespace lamina {

/// Whether all of the map was written.
inline bool run_map(const MapRequest& request) {
  const Requested run = requested(request);
  io::make_results_folder(request.output);
  return write_results(request.output, map(run.source, run.options)).whole;
}

}  // namespace lamina
