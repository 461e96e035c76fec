// Offline: all of the recording at hand.
#include <lamina/pipeline/map_steps.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <span>

#include <lamina/backend/refine/refiner.hpp>
#include <lamina/pipeline/calibration/extrinsics_uncertainty.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/calibration/report.hpp>
#include <lamina/pipeline/extrinsics_refinement.hpp>
#include <lamina/pipeline/hole_steps.hpp>
#include <lamina/pipeline/path_correction.hpp>

namespace lamina {
namespace {

// s before the end, for what is written after a signal.
constexpr double kForWriting = 0.6;

void refine(Mapper& mapper, RunRecord& record, const std::function<bool()>& ended) {
  const Trajectory before = mapper.trajectory();
  const RefineResult result = mapper.refine({}, [&](const RefineProgress&) { return !ended(); });
  if (!ended()) {
    const auto timer = record.diagnostics.time("covariances");
    mapper.know_covariances();
  }
  record.set_refinement(result, before, mapper.trajectory());
  // Nothing to solve is no plane, too: that is said once.
  const bool solved =
      result.status == SolveStatus::kConverged || result.status == SolveStatus::kNothingToSolve;
  if (!solved && !ended()) run_log().warn("refinement: {}", to_string(result.status));
}

// Where an image's floor gave the first pose, the map's floor takes its place: it becomes z = 0,
// the first pose's origin is above (0, 0), its heading along x.
void level(Mapper& mapper) {
  const PlanarMap map = mapper.map();
  const MapPlane* floor = nullptr;
  for (const MapPlane& plane : map.planes) {
    if (plane.label == PlaneLabel::kFloor && (!floor || plane.area > floor->area)) floor = &plane;
  }
  // A user's factors may say where the map is.
  if (!floor || map.trajectory.empty() || !mapper.graph().custom.empty()) return;
  const SE3 T_first_map = map.trajectory[0].pose.inverse();
  mapper.move(levelled_pose(T_first_map * floor->plane_map) * T_first_map);
}

// Scans from before it was found what their largest range is.
void correct_range_max(std::vector<Step>& steps, const RangeCheck& check) {
  for (Step& step : steps)
    if (step.scan) step.scan->range_max = check.range_max(*step.scan);
}

bool images_alone(const std::vector<Step>& steps) {
  return std::none_of(steps.begin(), steps.end(), [](const Step& s) { return s.scan.has_value(); });
}

// Of a whole recording: its steps, and the loops that its scans closed.
struct Gathered {
  std::vector<Step> steps;
  std::vector<LoopClosure> loops;
};

Gathered read_all(Run& run) {
  Gathered all;
  const auto gather = [&all](const std::vector<LoopClosure>& found) {
    all.loops.insert(all.loops.end(), found.begin(), found.end());
  };
  for_each_step(run, [&](ClosedStep&& entry) {
    gather(entry.loops);
    run.observer.on_read(entry.step, run.record.diagnostics);
    all.steps.push_back(std::move(entry.step));
    return std::int64_t{0};
  });
  correct_range_max(all.steps, run.front_end.ranges().largest());
  if (const std::int64_t laid = lay_across_holes(all.steps); laid > 0) {
    run.record.diagnostics.warn(
        "odometry_hole",
        fmt::format("{} steps lie in holes of the odometry where images lost track: they were laid "
                    "along the way that wheels counted across the hole",
                    laid));
  }
  if (run.options.close_loops && !run.observer.hurried()) gather(run.closer.finish());
  return all;
}

// Second looks, now that the path is known: at mountings, wheels, images and slopes.
void correct_steps(Run& run, Gathered& all, ExtrinsicsUncertainty& uncertainty,
                   MapperOptions& options) {
  const MapOptions& settings = run.options;
  Diagnostics& metrics = run.record.diagnostics;
  std::vector<Step>& steps = all.steps;
  const auto ended = [&] { return run.observer.hurried(); };
  const bool wheels = run.front_end.motion().wheels().met_on_floor();
  if (settings.calibrate_mountings && !ended())
    uncertainty.update(correct_mountings(steps, all.loops, wheels, metrics));
  if (settings.calibrate_wheels && wheels && !ended()) {
    const auto sigmas = correct_wheels(steps, run.recording->calibration(), options,
                                       settings.calibrate_mountings, metrics, ended);
    if (sigmas) run.record.wheel_path.know(*sigmas);
  }
  if (!run.open_again) return;
  if (settings.images_beside_wheels && run.front_end.motion().wheels().met() && !ended()) {
    uncertainty.update(correct_motions_by_images(run.open_again, run.front_end.depth_distortion(),
                                                 steps, settings.calibrate_mountings && wheels,
                                                 metrics, ended));
  }
  if (settings.follow_slopes && run.front_end.motion().slopes().images() > 0 && !ended())
    options.window_trusts_tilt =
        !lift_off_plane(run.open_again, run.front_end.depth_distortion(), steps, metrics, ended);
}

// How many were mapped before time was up.
std::int64_t map_steps(Run& run, const std::vector<Step>& steps, StepMapper& mapping) {
  run.observer.on_stage(static_cast<std::int64_t>(steps.size()));
  std::int64_t mapped = 0;
  for (const Step& step : steps) {
    if (mapped > 0 && run.observer.seconds_left() < kForWriting) break;
    mapping.add(step);
    run.observer.on_progress(++mapped, mapping.plane_count());
    run.observer.on_mapped(step, mapping.mapper, run.record.diagnostics);
  }
  run.observer.on_stage_end();
  return mapped;
}

}  // namespace

Mapper map_offline(Run& run) {
  RunRecord& record = run.record;
  const auto ended = [&] { return run.observer.hurried(); };
  Gathered all = read_all(run);
  std::vector<Step>& steps = all.steps;
  const bool levelled =
      run.front_end.motion().levelled_by_image() ||
      (images_alone(steps) && !run.front_end.motion().wheels().met() && begin_levelled(steps));
  MapperOptions options = run.options.mapper;
  if (!all.loops.empty()) {
    follow(steps, run.closer.corrected());
    // The path's loops are closed before the window sees it: smoothing must not bend it apart, and
    // nothing else needs to recognise places.
    options.window_motion_trust = 5;
    options.place.enabled = false;
    options.window.keyframes = std::min(options.window.keyframes, 10);
  }
  ExtrinsicsUncertainty uncertainty(run.options);
  for (const Step& step : steps)
    uncertainty.met(step, run.front_end.motion().wheels().met_on_floor());  // as stated
  correct_steps(run, all, uncertainty, options);
  if (run.options.refine_extrinsics && !ended()) {
    CalibrationOptions settings = run.options;
    settings.mapper = options;
    refine_extrinsics(steps, all.loops, settings, record.diagnostics, ended);
  }
  StepMapper mapping(options, run.closer, record);
  Mapper& mapper = mapping.mapper;
  const std::int64_t mapped = map_steps(run, steps, mapping);
  record.go_on(std::span(steps).subspan(static_cast<std::size_t>(mapped)));
  record.diagnostics.counts.scan_loops = mapping.transfer(all.loops);
  if (run.options.add_factors) run.options.add_factors(mapper);
  run.observer.on_refining(mapper, record.diagnostics);
  if (!ended()) refine(mapper, record, ended);
  if (levelled) level(mapper);
  uncertainty.tell(mapper, record.diagnostics);
  return std::move(mapping.mapper);
}

}  // namespace lamina
