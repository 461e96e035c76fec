// Reader, front-end, loop closer and checkpoint, in a row.
#include <lamina/apps/steps.hpp>

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include <lamina/apps/loop_worker.hpp>
#include <lamina/apps/progress.hpp>
#include <lamina/apps/reader.hpp>

namespace lamina::apps {
namespace {

constexpr std::size_t kReadAhead = 16;  // frames: half a second of a 30 Hz camera

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

}  // namespace

// Online, nobody asks for the corrected path, and places seen again and again are searched in as
// many submaps as a scan is tried against.
LoopCloserOptions loop_options(const Settings& settings, bool online) {
  LoopCloserOptions options = settings.loops;
  if (online) {
    options.visits = std::max(1, options.max_candidates);
    options.keep_path = false;
  }
  return options;
}

namespace {

// How many measurements the steps of a checkpoint stand for.
std::int64_t gone_on_from_checkpoint(Run& run, const std::function<void(JournalEntry&&)>& take) {
  if (!run.checkpoint) return 0;
  if (!run.resume) {
    run.checkpoint->begin();
    return 0;
  }
  const std::int64_t skip = run.checkpoint->resume(run.front_end, run.closer, take);
  if (skip == 0) {
    spdlog::info("no checkpoint yet, starting from the beginning");
    return 0;
  }
  spdlog::info("resumed after {} measurements", skip);
  run.interrupt.something_stands();
  return skip;
}

}  // namespace

bool for_each_step(Run& run, const std::function<std::int64_t(JournalEntry&&)>& take) {
  std::int64_t done = 0, planes = 0;
  bool whole = true;
  const std::int64_t skip =
      gone_on_from_checkpoint(run, [&](JournalEntry&& entry) { planes = take(std::move(entry)); });
  io::Metrics& metrics = run.output.metrics;
  const auto hand_on = [&](std::vector<ClosedStep>&& closed) {
    for (ClosedStep& one : closed) {
      if (one.closing_ms) metrics.stages["loops"].add(*one.closing_ms);
      if (run.checkpoint) run.checkpoint->add(one.step, one.loops);
      planes = take({std::move(one.step), std::move(one.loops)});
      run.interrupt.something_stands();
    }
  };
  // Online, a step's loops must be there before the next: the closer stays in line.
  const bool beside = !run.online && run.settings.threads > 1;
  LoopWorker worker(run.settings.close_loops ? &run.closer : nullptr, beside);
  Reader reader(*run.recording, kReadAhead, run.checkpoint != nullptr);
  Progress progress(run.recording->size_hint(), run.quiet);
  while (const auto measurement = reader.next()) {
    if (++done <= skip) continue;
    const auto begin = std::chrono::steady_clock::now();
    auto step = run.front_end.process(*measurement, metrics);
    const bool is_step = step.has_value();
    if (is_step) {
      worker.add(std::move(*step));
      hand_on(worker.ready());
    }
    if (run.checkpoint) {
      run.checkpoint->measured();
      if (run.checkpoint->due()) {
        hand_on(worker.drain());
        run.checkpoint->save(run.front_end, run.closer);
      }
    }
    // All that stands between a measurement and the pose and map it gives.
    if (is_step && run.online) metrics.stages["frame"].add(milliseconds_since(begin));
    metrics.memory.note(stamp_of(*measurement).seconds());
    progress.update(done, planes);
    if (run.live) run.live->progress(done, run.recording->size_hint());
    if (run.interrupt.interrupted()) {
      whole = false;
      break;
    }
  }
  hand_on(worker.drain());
  if (run.checkpoint) run.checkpoint->save(run.front_end, run.closer);
  worker.stop();
  reader.stop();
  progress.finish();
  metrics.stages["decode"] = reader.decode_times();
  metrics.counts["measurements"] = static_cast<double>(done);
  return whole;
}

}  // namespace lamina::apps
