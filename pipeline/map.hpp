// A recording in, a map out: everything that `lamina map` does, as one call.
#pragma once

#include <filesystem>
#include <string>

#include <lamina/pipeline/map_options.hpp>
#include <lamina/pipeline/map_result.hpp>
#include <lamina/pipeline/run_observer.hpp>
#include <lamina/sensors/recording_source.hpp>

namespace lamina {

/// Maps a recording or a live device: looks at its sensors first, reads it through the front-end,
/// closes loops, maps, refines, gathers what all looks saw and draws the grids. Prints nothing and
/// writes no results (write_results.hpp does). Where the observer stops it, the map is of what was
/// read so far (`stopped`). Throws lamina::Error for a recording that cannot be read, or of which
/// no scan and no image could be used.
MapResult map(const RecordingSource& source, const MapOptions& options, RunObserver& observer);
MapResult map(const RecordingSource& source, const MapOptions& options);

}  // namespace lamina
