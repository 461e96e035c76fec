// The straight line: recording, first look, front-end, mapper, refiner, evidence, grids.
#include <lamina/pipeline/map.hpp>

#include <fmt/format.h>

#include <memory>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/calibration/self_calibration.hpp>
#include <lamina/pipeline/map_input.hpp>
#include <lamina/pipeline/map_steps.hpp>
#include <lamina/pipeline/run_warnings.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {
namespace {

std::unique_ptr<Checkpoint> checkpoint_of(const MapInput& input) {
  const MapOptions& options = input.options;
  if (input.live() && options.resume)
    throw Error("--resume: found a live device, expected a recording");
  if (options.checkpoint_folder.empty() || input.live()) return nullptr;
  auto checkpoint = std::make_unique<Checkpoint>(
      options.checkpoint_folder, options.checkpoint_identity, options.checkpoint_interval);
  if (options.resume) checkpoint->require_same_run();
  return checkpoint;
}

// A look over the whole recording before it is mapped; online, what is found on the way.
void look_first(MapInput& input, FrontEnd& front_end, Run& run) {
  if (!input.live()) run.open_again = [&input] { return input.open_again(); };
  if (run.open_again && input.clocks.any()) {
    input.recording.reset();
    input.recording = input.open_again();
  }
  if (!input.offline()) return begin_online(front_end, input.options);
  const OpenReclocked open_reclocked = [&input](const ClockOffsets& offsets) {
    return input.open_reclocked(offsets);
  };
  self_calibrate(
      {input.recording, run.open_again, open_reclocked, input.clocks, input.scanner, input.options,
       run.record.diagnostics, [&run] { return run.observer.should_stop(); }},
      front_end);
}

void require_steps(const std::string& name, const Mapper& mapper, const Diagnostics& diagnostics) {
  if (!mapper.trajectory().empty()) return;
  throw Error(name + ": found no scan and no depth frame that could be used (" +
              skipped_text(diagnostics) + "), expected at least one");
}

// What the run found out about its sensors, its input and its result.
void report(MapResult& result, MapInput& input, const Run& run) {
  Diagnostics& diagnostics = result.diagnostics();
  result.calibration = result.record->mountings.over(input.sensors);
  result.clocks = input.clocks;
  result.restamped = input.recording->restamped();
  if (run.checkpoint) diagnostics.counts.checkpoints = static_cast<double>(run.checkpoint->saves());
}

// Images that show no floor where their mounting says make no free ground.
void check_ground(const MapInput& input, const FrontEnd& front_end, Diagnostics& diagnostics) {
  if (!input.cameras.no_ground || !front_end.depth_checks().floors.hardly_any()) return;
  const Warning& unseen = *input.cameras.no_ground;
  if (!unseen.id.empty()) diagnostics.warn(unseen.id, unseen.text);
  diagnostics.counts.images_show_no_floor = 1;
}

void warn(MapResult& result, MapInput& input, const FrontEnd& front_end, RunObserver& observer) {
  Diagnostics& diagnostics = result.diagnostics();
  if (input.options.online && !input.live() && !result.stopped)
    warn_of_scanner(
        *input.open_again(), input.options, [&observer] { return observer.should_stop(); },
        diagnostics);
  if (result.stopped && !input.live()) {  // Ctrl-C is how a live run ends
    warn_of_end(*input.recording, !input.options.checkpoint_folder.empty(), *result.record);
  }
  warn_of_result(result.recording, *input.recording, front_end, diagnostics);
  diagnostics.readings = input.readings;
  const auto skipped = input.recording->skipped();
  for (const auto& [why, place] : input.recording->first_skipped())
    result.notes.push_back(fmt::format("skipped {} x {}, first {}", skipped.at(why), why, place));
}

}  // namespace

MapResult map(const RecordingSource& source, const MapOptions& options, RunObserver& observer) {
  if (options.online && options.add_factors) {
    throw Error(
        "add_factors: found online mode, expected offline; OnlineMapper::mapper() takes "
        "factors on the way");
  }
  MapInput input(source, options, observer);
  const auto kept = std::make_shared<RunRecord>(options.scratch_folder);
  RunRecord& record = *kept;
  record.diagnostics.input = source.name;
  record.diagnostics.command = options.command;
  input.note(record.diagnostics);
  note_assumed(*input.recording, record.diagnostics);
  FrontEnd front_end(input.options, input.sensors);
  const std::unique_ptr<Checkpoint> checkpoint = checkpoint_of(input);
  Run run{input.recording, front_end, input.options, record, checkpoint.get(), observer};
  run.closer.keep_submaps_in(options.scratch_folder);
  look_first(input, front_end, run);
  Mapper mapper = options.online ? map_online(run) : map_offline(run);
  record.add_skipped(input.recording->skipped());
  report_front_end(front_end, record);
  require_steps(source.name, mapper, record.diagnostics);
  MapResult result{source.name, input.options, std::move(mapper), kept};
  report(result, input, run);
  check_ground(input, front_end, result.diagnostics());
  result.map = result.mapper.map();
  result.trajectory =
      options.online ? result.mapper.online_trajectory() : result.mapper.trajectory();
  result.stopped = observer.should_stop();
  finish_map(result, observer);
  warn(result, input, front_end, observer);
  return result;
}

MapResult map(const RecordingSource& source, const MapOptions& options) {
  RunObserver nobody;
  return map(source, options, nobody);
}

}  // namespace lamina
