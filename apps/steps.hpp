// One run over a recording: all its measurements through the front-end and the loop closer.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include <lamina/apps/checkpoint.hpp>
#include <lamina/apps/front_end.hpp>
#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/live.hpp>
#include <lamina/apps/map_output.hpp>
#include <lamina/frontend/odometry/loop_closer.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {

/// As settings say. Online, what is kept of the way must not grow with the laps.
LoopCloserOptions loop_options(const Settings& settings, bool online);

/// What a run goes through with.
struct Run {
  std::unique_ptr<Recording>& recording;
  FrontEnd& front_end;
  const Settings& settings;
  MapOutput& output;
  Checkpoint* checkpoint;  // null: live, nothing to go on from
  InterruptGuard& interrupt;
  bool resume = false, quiet = false, online = false;
  LivePage* live = nullptr;  // null: nobody looks on
  /// The recording from its beginning; empty: live.
  std::function<std::unique_ptr<Recording>()> open_again{};
  LoopCloser closer{loop_options(settings, online)};
};

/// Reads everything; `take` gets each step with the loops its scan closed and returns how many
/// planes there are now. Goes on from a checkpoint when asked to, and leaves one of all that was
/// read; ends early on Ctrl-C. Offline and with two threads, loops are closed beside the front-end.
/// Returns false where it was ended early.
bool for_each_step(Run& run, const std::function<std::int64_t(JournalEntry&&)>& take);

}  // namespace lamina::apps
