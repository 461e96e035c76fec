// Online: each step is mapped as it comes.
#include <lamina/pipeline/online_mapper.hpp>

#include <malloc.h>
#include <spdlog/spdlog.h>

#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/calibration/report.hpp>
#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>
#include <lamina/pipeline/diagnostics.hpp>
#include <lamina/pipeline/write_results.hpp>

namespace lamina {
namespace {

// What the solver needed for a moment lies between what stays: its pages go back to the system.
void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace

AddResult StepMapper::add(const Step& step) {
  const AddResult added = mapper.add(step.observations, step.motion.T_from_to,
                                     step.motion.covariance, observed_by_sensor(step));
  record_.diagnostics.stages["associate"].add(added.associate_ms);
  if (added.is_keyframe) record_.diagnostics.stages["window"].add(added.window_ms);
  record_.window.add(step.observations.stamp, added, mapper.options().window);
  if (step.scan && closer_.starts_submap(step.observations.stamp))
    book_.note(step.observations, added, mapper);
  record_.add(step, added);
  return added;
}

OnlineSteps::OnlineSteps(const MapOptions& options, const LoopCloser& closer, RunRecord& record)
    : mapping_(options.mapper, closer, record), uncertainty_(options), record_(record) {
  mapping_.mapper.keep_frames_in(options.scratch_folder);
}

void OnlineSteps::add(const Step& step, const std::vector<LoopClosure>& loops, bool wheels) {
  constexpr int kTrimEvery = 4;  // 20: some 3 MB more over half an hour
  uncertainty_.met(step, wheels);
  const AddResult added = mapping_.add(step);
  upkeep_.added(added, mapping_.mapper);
  if (added.is_keyframe && ++keyframes_ % kTrimEvery == 0) give_back_memory();
  const int taken = mapping_.transfer(loops);
  record_.diagnostics.counts.scan_loops += taken;
  if (!upkeep_.due(taken, mapping_.mapper)) return;
  refine();
  give_back_memory();
}

void OnlineSteps::refine() {
  const auto timer = record_.diagnostics.time("refine");
  upkeep_.refine(mapping_.mapper);
}

Mapper OnlineSteps::finish(bool hurried) {
  // The map that is left behind: what the last places told of it, too.
  if (!hurried) refine();
  uncertainty_.tell(mapping_.mapper, record_.diagnostics);
  return std::move(mapping_.mapper);
}

void begin_online(FrontEnd& front_end, const MapOptions& options) {
  if (options.online && options.follow_slopes) front_end.motion().follow_slopes();
  if (options.online && options.images_beside_wheels) front_end.motion().ask_images_beside_wheels();
  if (options.find_sweep && options.sweep == 0) front_end.motion().scan_duration().watch();
}

void report_front_end(const FrontEnd& front_end, RunRecord& record) {
  if (front_end.motion().wheels().met_on_floor())
    record.wheel_path.tell(front_end.motion().wheels().errors_left(), record.diagnostics);
  if (const double noise = front_end.ranges().most_noise(); noise > 0) {
    run_log().info("scanner's ranges scatter by up to {:.1f} cm, more than stated: taken so",
                   100 * noise);
    record.diagnostics.counts.scanner_noise_cm = 100 * noise;
  }
  for (Warning& found : record.changes.warnings())
    record.diagnostics.warn(std::move(found.id), std::move(found.text));
  record.add_skipped(front_end.skipped());
}

Mapper map_online(Run& run) {
  OnlineSteps steps(run.options, run.closer, run.record);
  for_each_step(run, [&](ClosedStep&& entry) {
    steps.add(entry.step, entry.loops, run.front_end.motion().wheels().met_on_floor());
    run.observer.on_mapped(entry.step, steps.mapper(), run.record.diagnostics);
    return steps.plane_count();
  });
  return steps.finish(run.observer.hurried());
}

OnlineMapper::OnlineMapper(const Calibration& calibration, const MapOptions& options)
    : options_(options),
      front_end_(options, calibration),
      closer_([&options] {
        MapOptions online = options;
        online.online = true;
        return loop_options(online);
      }()),
      record_(std::make_shared<RunRecord>(options.scratch_folder)),
      steps_(options, closer_, *record_),
      calibration_(calibration) {
  options_.online = true;
  begin_online(front_end_, options_);
}

std::optional<SE3> OnlineMapper::add(const Measurement& measurement) {
  auto step = front_end_.process(measurement, record_->diagnostics);
  if (const auto sweep = front_end_.motion().scan_duration().take_found())
    tell_sweep(*sweep, record_->diagnostics);
  if (!step) return std::nullopt;
  const ClosedStep closed =
      close_loops(std::move(*step), options_.close_loops ? &closer_ : nullptr);
  steps_.add(closed.step, closed.loops, front_end_.motion().wheels().met_on_floor());
  return steps_.mapper().current_pose();
}

Grids OnlineMapper::grid() {
  PlanarMap drawn = map();
  const Trajectory path = steps_.mapper().online_trajectory();
  const GridOptions options = grid_options(options_);
  add_evidence(drawn, *record_, path, options);
  return build_grids(drawn, *record_, path, options, RunObserver());
}

Diagnostics OnlineMapper::diagnostics() const {
  Diagnostics all = record_->diagnostics;
  all.skipped = front_end_.skipped();
  return all;
}

// What is reported is of this instant: the record that goes on does not keep it.
void OnlineMapper::save(const std::filesystem::path& folder) {
  const Diagnostics so_far = record_->diagnostics;
  const Mapper& mapper = steps_.mapper();
  MapResult result{"online", options_, Mapper(options_.mapper, mapper.state()), record_};
  steps_.report_uncertainty(result.mapper);
  report_front_end(front_end_, *record_);
  result.map = result.mapper.map();
  result.trajectory = mapper.online_trajectory();
  result.calibration = record_->mountings.over(calibration_);
  RunObserver nobody;
  finish_map(result, nobody);
  for (Warning& one : result_warnings(result.recording, front_end_, record_->diagnostics))
    record_->diagnostics.warn(std::move(one.id), std::move(one.text));
  write_results(folder, result, nobody);
  record_->diagnostics = so_far;
}

}  // namespace lamina
