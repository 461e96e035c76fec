// Offline and online: steps through the mapper.
#include <lamina/apps/map_steps.hpp>

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <span>

#include <lamina/apps/calibration.hpp>
#include <lamina/apps/dead_reckoning.hpp>
#include <lamina/apps/hole_steps.hpp>
#include <lamina/apps/loop_book.hpp>
#include <lamina/apps/mounting_doubt.hpp>
#include <lamina/apps/progress.hpp>
#include <lamina/backend/online_upkeep.hpp>
#include <lamina/backend/refiner.hpp>

namespace lamina::apps {
namespace {

// s before the end, for what is written after a signal.
constexpr double kForWriting = 0.6;

void refine(Mapper& mapper, MapOutput& output, const std::function<bool()>& ended) {
  const Trajectory before = mapper.trajectory();
  const RefineResult result = mapper.refine({}, [&](const RefineProgress&) { return !ended(); });
  if (!ended()) {
    const auto timer = output.metrics.time("covariances");
    mapper.know_covariances();
  }
  output.set_refinement(result, before, mapper.trajectory());
  // Nothing to solve is no plane, too: that is said once.
  const bool solved =
      result.status == SolveStatus::kConverged || result.status == SolveStatus::kNothingToSolve;
  if (!solved && !ended()) spdlog::warn("refinement: {}", to_string(result.status));
}

// The online line: each step is mapped as it comes.
AddResult map_step(const Step& step, Mapper& mapper, const LoopCloser& closer, LoopBook& book,
                   MapOutput& output) {
  const AddResult added =
      mapper.add(step.observations, step.motion.T_from_to, step.motion.covariance);
  output.metrics.stages["associate"].add(added.associate_ms);
  if (added.is_keyframe) output.metrics.stages["window"].add(added.window_ms);
  output.window.add(step.observations.stamp, added, mapper.options().window);
  if (step.scan && closer.starts_submap(step.observations.stamp))
    book.note(step.observations, added, mapper);
  output.add(step, added);
  return added;
}

// Where an image's floor gave the first pose, the map's floor takes its place: it becomes z = 0,
// the first pose's origin is above (0, 0), its heading along x.
void level(Mapper& mapper) {
  const PlanarMap map = mapper.map();
  const MapPlane* floor = nullptr;
  for (const MapPlane& plane : map.planes) {
    if (plane.label == PlaneLabel::kFloor && (!floor || plane.area > floor->area)) floor = &plane;
  }
  if (!floor || map.trajectory.empty()) return;
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

std::int64_t plane_count(const Mapper& mapper) {
  return static_cast<std::int64_t>(mapper.graph().planes.size());
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
  for_each_step(run, [&](JournalEntry&& entry) {
    gather(entry.loops);
    if (run.live) run.live->read(entry.step, run.output.metrics);
    all.steps.push_back(std::move(entry.step));
    return std::int64_t{0};
  });
  correct_range_max(all.steps, run.front_end.range_check());
  if (const std::int64_t laid = lay_across_holes(all.steps); laid > 0) {
    run.output.metrics.warn(
        "odometry_hole",
        fmt::format("the odometry is silent at {} images that lost track: they were laid along "
                    "the way that wheels counted across the hole",
                    laid));
  }
  if (run.settings.close_loops && !run.interrupt.ending()) gather(run.closer.finish());
  return all;
}

// Second looks, now that the path is known: at mountings, wheels, images and slopes.
void correct_steps(Run& run, Gathered& all, MountingDoubt& doubt, MapperOptions& options) {
  const Settings& settings = run.settings;
  io::Metrics& metrics = run.output.metrics;
  std::vector<Step>& steps = all.steps;
  const auto ended = [&] { return run.interrupt.ending(); };
  const bool wheels = run.front_end.met_wheels();
  if (settings.calibrate_mountings && !ended())
    doubt.hear(correct_mountings(steps, all.loops, wheels, metrics));
  if (settings.calibrate_wheels && wheels && !ended()) {
    const auto sigmas =
        correct_wheels(steps, options, settings.calibrate_mountings, metrics, ended);
    if (sigmas) run.output.wheel_path.know(*sigmas);
  }
  if (!run.open_again) return;
  if (settings.images_beside_wheels && run.front_end.met_odometry() && !ended()) {
    doubt.hear(correct_motions_by_images(run.open_again, run.front_end.depth_distortion(), steps,
                                         settings.calibrate_mountings && wheels, metrics, ended));
  }
  if (settings.follow_slopes && run.front_end.slopes_seen() > 0 && !ended())
    options.window_trusts_tilt =
        !lift_off_plane(run.open_again, run.front_end.depth_distortion(), steps, metrics, ended);
}

// How many were mapped before time was up.
std::int64_t map_steps(Run& run, const std::vector<Step>& steps, Mapper& mapper, LoopBook& book) {
  Progress progress(static_cast<std::int64_t>(steps.size()), run.quiet);
  std::int64_t mapped = 0;
  for (const Step& step : steps) {
    if (mapped > 0 && run.interrupt.out_of_time(kForWriting)) break;
    map_step(step, mapper, run.closer, book, run.output);
    progress.update(++mapped, plane_count(mapper));
    if (!run.live) continue;
    run.live->progress(mapped, static_cast<std::int64_t>(steps.size()));
    run.live->mapped(step, mapper, run.output.metrics);
  }
  progress.finish();
  return mapped;
}

// What the solver needed for a moment lies between what stays: its pages go back to the system.
void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace

Mapper map_offline(Run& run) {
  MapOutput& output = run.output;
  const auto ended = [&] { return run.interrupt.ending(); };
  Gathered all = read_all(run);
  std::vector<Step>& steps = all.steps;
  const bool levelled =
      run.front_end.levelled_by_image() ||
      (images_alone(steps) && !run.front_end.met_odometry() && begin_levelled(steps));
  MapperOptions options = run.settings.mapper;
  if (!all.loops.empty()) {
    follow(steps, run.closer.corrected());
    // The path's loops are closed before the window sees it: smoothing must not bend it apart, and
    // nothing else needs to recognise places.
    options.window_motion_trust = 5;
    options.place.enabled = false;
    options.window.keyframes = std::min(options.window.keyframes, 10);
  }
  MountingDoubt doubt(run.settings);
  for (const Step& step : steps) doubt.met(step, run.front_end.met_wheels());  // as stated
  correct_steps(run, all, doubt, options);
  Mapper mapper(options);
  LoopBook book;
  const std::int64_t mapped = map_steps(run, steps, mapper, book);
  output.go_on(std::span(steps).subspan(static_cast<std::size_t>(mapped)));
  output.metrics.counts["scan_loops"] = book.hand_over(all.loops, mapper);
  if (run.live) run.live->refining(mapper, output.metrics);
  if (!ended()) refine(mapper, output, ended);
  if (levelled) level(mapper);
  doubt.tell(mapper, output.metrics);
  return mapper;
}

Mapper map_online(Run& run) {
  MapOutput& output = run.output;
  Mapper mapper(run.settings.mapper);
  LoopBook book;
  OnlineUpkeep upkeep;
  MountingDoubt doubt(run.settings);
  constexpr int kTrimEvery = 4;  // 20: some 3 MB more over half an hour
  int keyframes = 0;
  mapper.keep_frames_in(output.folder());
  for_each_step(run, [&](JournalEntry&& entry) {
    doubt.met(entry.step, run.front_end.met_wheels());
    const AddResult added = map_step(entry.step, mapper, run.closer, book, output);
    upkeep.added(added, mapper);
    if (added.is_keyframe && ++keyframes % kTrimEvery == 0) give_back_memory();
    if (run.live) run.live->mapped(entry.step, mapper, output.metrics);
    const int taken = book.hand_over(entry.loops, mapper);
    output.metrics.counts["scan_loops"] += taken;
    if (upkeep.due(taken, mapper)) {
      const auto timer = output.metrics.time("refine");
      upkeep.refine(mapper);
      give_back_memory();
    }
    return plane_count(mapper);
  });
  // The map that is left behind: what the last places told of it, too.
  if (!run.interrupt.ending()) {
    const auto timer = output.metrics.time("refine");
    upkeep.refine(mapper);
  }
  doubt.tell(mapper, output.metrics);
  return mapper;
}

}  // namespace lamina::apps
