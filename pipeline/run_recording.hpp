// One run over a recording: all its measurements through the front-end and the loop closer.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/loops/loop_closer.hpp>
#include <lamina/pipeline/checkpoint.hpp>
#include <lamina/pipeline/map_options.hpp>
#include <lamina/pipeline/run_observer.hpp>
#include <lamina/pipeline/run_record.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// As options say. Online, what is kept of the way must not grow with the laps.
LoopCloserOptions loop_options(const MapOptions& options);

/// What a run goes through with.
struct Run {
  std::unique_ptr<Recording>& recording;
  FrontEnd& front_end;
  const MapOptions& options;
  RunRecord& record;
  Checkpoint* checkpoint;  ///< null: nothing to go on from
  RunObserver& observer;
  /// The recording from its beginning; empty: live.
  std::function<std::unique_ptr<Recording>()> open_again{};
  LoopCloser closer{loop_options(options)};
};

/// Reads everything; `take` gets each step with the loops its scan closed and returns how many
/// planes there are now. Goes on from a checkpoint when asked to, and leaves one of all that was
/// read; ends early where the observer stops it. Offline and with two threads, loops are closed
/// beside the front-end. Returns false where it was ended early.
bool for_each_step(Run& run, const std::function<std::int64_t(ClosedStep&&)>& take);

}  // namespace lamina
