// Reader, front-end, loop closer and checkpoint, in a row.
#include <lamina/pipeline/run_recording.hpp>

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/calibration/report.hpp>
#include <lamina/pipeline/loop_worker.hpp>
#include <lamina/pipeline/reader.hpp>

namespace lamina {
namespace {

constexpr std::size_t kReadAhead = 16;  // frames: half a second of a 30 Hz camera

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

}  // namespace

// Online, nobody asks for the corrected path, and places seen again and again are searched in as
// many submaps as a scan is tried against.
LoopCloserOptions loop_options(const MapOptions& options) {
  LoopCloserOptions loops = options.loops;
  if (options.online) {
    loops.visits = std::max(1, loops.max_candidates);
    loops.keep_path = false;
  }
  return loops;
}

namespace {

// How many measurements the steps of a checkpoint stand for.
std::int64_t gone_on_from_checkpoint(Run& run, const std::function<void(ClosedStep&&)>& take) {
  if (!run.checkpoint) return 0;
  if (!run.options.resume) {
    run.checkpoint->begin();
    return 0;
  }
  const std::int64_t skip = run.checkpoint->resume(run.front_end, run.closer, take);
  if (skip == 0) {
    run_log().info("no checkpoint yet, starting from the beginning");
    return 0;
  }
  run_log().info("resumed after {} measurements", skip);
  run.observer.on_first_step();
  return skip;
}

}  // namespace

bool for_each_step(Run& run, const std::function<std::int64_t(ClosedStep&&)>& take) {
  std::int64_t done = 0, planes = 0;
  bool whole = true;
  const std::int64_t skip =
      gone_on_from_checkpoint(run, [&](ClosedStep&& entry) { planes = take(std::move(entry)); });
  Diagnostics& metrics = run.record.diagnostics;
  const auto hand_on = [&](std::vector<ClosedStep>&& closed) {
    for (ClosedStep& one : closed) {
      if (one.closing_ms) metrics.stages["loops"].add(*one.closing_ms);
      if (run.checkpoint) run.checkpoint->add(one.step, one.loops);
      planes = take(std::move(one));
      run.observer.on_first_step();
    }
  };
  // Online, a step's loops must be there before the next: the closer stays in line.
  const bool beside = !run.options.online && run.options.threads > 1;
  LoopWorker worker(run.options.close_loops ? &run.closer : nullptr, beside);
  Reader reader(*run.recording, kReadAhead, run.checkpoint != nullptr);
  run.observer.on_stage(run.recording->size_hint());
  while (const auto measurement = reader.next()) {
    if (++done <= skip) continue;
    const auto begin = std::chrono::steady_clock::now();
    auto step = run.front_end.process(*measurement, metrics);
    if (const auto sweep = run.front_end.motion().scan_duration().take_found())
      tell_sweep(*sweep, metrics);
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
    if (is_step && run.options.online) metrics.stages["frame"].add(milliseconds_since(begin));
    metrics.memory.note(stamp_of(*measurement).seconds());
    run.observer.on_progress(done, planes);
    if (run.observer.should_stop()) {
      whole = false;
      break;
    }
  }
  hand_on(worker.drain());
  if (run.checkpoint) run.checkpoint->save(run.front_end, run.closer);
  worker.stop();
  reader.stop();
  run.observer.on_stage_end();
  metrics.stages["decode"] = reader.decode_times();
  metrics.counts.measurements = static_cast<double>(done);
  return whole;
}

}  // namespace lamina
