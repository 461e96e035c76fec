// The straight line of the program: recording, front-end, mapper, refiner, files.
#include <lamina/apps/mapping.hpp>

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <span>

#include <lamina/apps/calibration.hpp>
#include <lamina/apps/camera_checks.hpp>
#include <lamina/apps/camera_clock.hpp>
#include <lamina/apps/checkpoint.hpp>
#include <lamina/apps/dead_reckoning.hpp>
#include <lamina/apps/doubts.hpp>
#include <lamina/apps/first_looks.hpp>
#include <lamina/apps/front_end.hpp>
#include <lamina/apps/hole_steps.hpp>
#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/live.hpp>
#include <lamina/apps/loop_book.hpp>
#include <lamina/apps/map_output.hpp>
#include <lamina/apps/mounting_doubt.hpp>
#include <lamina/apps/preset.hpp>
#include <lamina/apps/progress.hpp>
#include <lamina/apps/run_warnings.hpp>
#include <lamina/apps/scanner_calibration.hpp>
#include <lamina/apps/steps.hpp>
#include <lamina/backend/mapper.hpp>
#include <lamina/backend/online_upkeep.hpp>
#include <lamina/backend/refiner.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/sealed_file.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/corrected_recording.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/text.hpp>

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

// Offline: dead reckoning and loops over the whole recording first, so that the mapper meets old
// planes where they are; then window, loops and refinement.
Mapper map_offline(Run& run) {
  const Settings& settings = run.settings;
  MapOutput& output = run.output;
  std::vector<Step> steps;
  std::vector<LoopClosure> loops;
  const auto gather = [&loops](const std::vector<LoopClosure>& found) {
    loops.insert(loops.end(), found.begin(), found.end());
  };
  for_each_step(run, [&](JournalEntry&& entry) {
    gather(entry.loops);
    if (run.live) run.live->read(entry.step, output.metrics);
    steps.push_back(std::move(entry.step));
    return std::int64_t{0};
  });
  correct_range_max(steps, run.front_end.range_check());
  if (const std::int64_t laid = lay_across_holes(steps); laid > 0) {
    output.metrics.warn("odometry_hole",
                        fmt::format("the odometry is silent at {} images that lost track: they "
                                    "were laid along the way that wheels counted across the hole",
                                    laid));
  }
  const auto ended = [&] { return run.interrupt.ending(); };
  if (settings.close_loops && !ended()) gather(run.closer.finish());
  const bool levelled =
      run.front_end.levelled_by_image() ||
      (images_alone(steps) && !run.front_end.met_odometry() && begin_levelled(steps));
  MapperOptions options = settings.mapper;
  if (!loops.empty()) {
    follow(steps, run.closer.corrected());
    // The path's loops are closed before the window sees it: smoothing must not bend it apart, and
    // nothing else needs to recognise places.
    options.window_motion_trust = 5;
    options.place.enabled = false;
    options.window.keyframes = std::min(options.window.keyframes, 10);
  }
  MountingDoubt doubt(settings);
  for (const Step& step : steps) doubt.met(step, run.front_end.met_wheels());  // as stated
  if (settings.calibrate_mountings && !ended())
    doubt.hear(correct_mountings(steps, loops, run.front_end.met_wheels(), output.metrics));
  const bool wheels = run.front_end.met_wheels();
  if (settings.calibrate_wheels && wheels && !ended()) {
    const auto sigmas =
        correct_wheels(steps, options, settings.calibrate_mountings, output.metrics, ended);
    if (sigmas) output.wheel_path.know(*sigmas);
  }
  if (run.open_again && settings.images_beside_wheels && run.front_end.met_odometry() && !ended()) {
    doubt.hear(correct_motions_by_images(run.open_again, run.front_end.depth_distortion(), steps,
                                         settings.calibrate_mountings && wheels, output.metrics,
                                         ended));
  }
  if (run.open_again && settings.follow_slopes && run.front_end.slopes_seen() > 0 && !ended())
    options.window_trusts_tilt = !lift_off_plane(run.open_again, run.front_end.depth_distortion(),
                                                 steps, output.metrics, ended);
  Mapper mapper(options);
  LoopBook book;
  Progress progress(static_cast<std::int64_t>(steps.size()), run.quiet);
  std::int64_t mapped = 0;
  for (const Step& step : steps) {
    if (mapped > 0 && run.interrupt.out_of_time(kForWriting)) break;
    map_step(step, mapper, run.closer, book, output);
    progress.update(++mapped, plane_count(mapper));
    if (!run.live) continue;
    run.live->progress(mapped, static_cast<std::int64_t>(steps.size()));
    run.live->mapped(step, mapper, output.metrics);
  }
  progress.finish();
  output.go_on(std::span(steps).subspan(static_cast<std::size_t>(mapped)));
  output.metrics.counts["scan_loops"] = book.hand_over(loops, mapper);
  if (run.live) run.live->refining(mapper, output.metrics);
  if (!ended()) refine(mapper, output, ended);
  if (levelled) level(mapper);
  doubt.tell(mapper, output.metrics);
  return mapper;
}

// What the solver needed for a moment lies between what stays: its pages go back to the system.
void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

// Online: what a robot would have had at each instant.
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

// How much the recording holds: one that was replaced or has grown is another.
std::string extent_of(const std::filesystem::path& input) {
  namespace fs = std::filesystem;
  if (fs::is_regular_file(input)) return std::to_string(fs::file_size(input)) + " bytes";
  if (!fs::is_directory(input)) return "live";
  std::uintmax_t files = 0, bytes = 0;
  for (const auto& entry : fs::directory_iterator(input)) {
    if (!entry.is_regular_file()) continue;
    ++files;
    bytes += entry.file_size();
  }
  return fmt::format("{} files, {} bytes", files, bytes);
}

// "none", or what tells a file's content from another's.
std::string content_of(const std::optional<std::filesystem::path>& file) {
  if (!file) return "none";
  return fmt::format("{:016x}", io::checksum(read_file_bytes(*file)));
}

// What a checkpoint must have in common with the run that goes on from it; what changes no result
// is left out.
std::string identity(const MapRequest& request, Settings settings) {
  settings.threads = 1;
  settings.checkpoint_interval = 30;
  return "input: " + std::filesystem::weakly_canonical(request.input).string() +
         "\nrecording: " + extent_of(request.input) +
         "\ncalibration: " + content_of(request.calibration) +
         "\nmode: " + (request.online ? "online" : "offline") + "\n" + to_yaml(settings, false);
}

// What signals do, and what is said where they leave no time to write.
InterruptGuard guard(const MapRequest& request, bool live) {
  const std::string again = request.resume ? "the same command" : "the same command with --resume";
  return {live ? InterruptGuard::Kind::kEndsReading : InterruptGuard::Kind::kWithinASecond,
          "warning: interrupted before there was a map: nothing was written" +
              std::string(request.resume ? ", the checkpoint is as it was" : ""),
          "warning: interrupted: there was no time to write the map; " + again +
              " goes on from the last checkpoint"};
}

}  // namespace

void set_up_log(bool quiet) {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "lamina", std::make_shared<spdlog::sinks::stderr_color_sink_mt>()));
  spdlog::set_pattern("%^%l%$: %v");
  spdlog::set_level(quiet ? spdlog::level::warn : spdlog::level::info);
}

int run_map(const MapRequest& request) {
  set_up_log(request.quiet);
  const bool live = request.input.rfind("openni:", 0) == 0;
  InterruptGuard interrupt = guard(request, live);
  RecordingOptions options;
  options.topics = chosen_topics(settings_of(request));
  options.calibration = request.calibration;
  ScanCorrection scanner;
  CameraFindings cameras;
  double max_tilt = Settings().scan_odometry.max_tilt;
  const auto open = [&]() -> std::unique_ptr<Recording> {
    return std::make_unique<CorrectedRecording>(
        corrected(open_recording(request.input, options), cameras.fixes), scanner, max_tilt);
  };
  std::unique_ptr<Recording> recording = open();
  Calibration sensors = recording->calibration();
  Settings settings = settings_of(request, &sensors);
  max_tilt = settings.scan_odometry.max_tilt;
  spdlog::info("preset {}", settings.preset);
  ClockOffsets clocks{-settings.scanner_delay, -settings.camera_delay, -settings.odometry_delay};
  if (!live && (sensors.depth_camera || sensors.stereo_camera)) {
    cameras =
        check_cameras(*recording, settings.floor, [&interrupt] { return interrupt.interrupted(); });
    recording.reset();
    look_at_camera_clock(open, sensors, clocks, settings, cameras.warnings,
                         [&interrupt] { return interrupt.interrupted(); });
    recording = open();
    sensors = recording->calibration();
  }
  io::make_results_folder(request.output);
  MapOutput output(request.output, settings);
  output.set_recording(request.input);
  for (const Warning& found : cameras.warnings) output.metrics.warn(found.id, found.text);
  note_clocks(clocks, settings, output.metrics);
  FrontEnd front_end(settings, sensors);
  output.end_with(interrupt);
  if (request.online && settings.follow_slopes) front_end.follow_slopes();
  if (request.online && settings.images_beside_wheels) front_end.ask_images_beside_wheels();
  if (live && request.resume) {
    throw Error("--resume: found the live device " + request.input + ", expected a recording");
  }
  Checkpoint checkpoint(request.output, identity(request, settings), settings.checkpoint_interval);
  if (request.resume) checkpoint.require_same_run();
  Run run{recording, front_end,      settings,      output,        live ? nullptr : &checkpoint,
          interrupt, request.resume, request.quiet, request.online};
  run.closer.keep_submaps_in(output.folder());
  std::optional<LivePage> page;
  if (request.live) {
    run.live = &page.emplace(*request.live, request.input);
    fmt::print(stderr, "live map: {}\n", page->url());
  }
  note_assumed(*recording, output.metrics);
  const OpenReclocked open_reclocked = [&](const ClockOffsets& offsets) {
    ++output.metrics.readings;
    return reclocked(open(), offsets);
  };
  output.metrics.readings = 1;
  if (!live) run.open_again = [&] { return open_reclocked(clocks); };
  if (!live && clocks.any()) {
    recording.reset();
    recording = run.open_again();
  }
  const auto ended = [&] { return interrupt.interrupted(); };
  const bool offline = !request.online && !live;
  if (!offline && settings.find_sweep && settings.sweep == 0) front_end.watch_for_sweep();
  if (offline)
    look_ahead({recording, run.open_again, open_reclocked, clocks, scanner, settings,
                output.metrics, ended},
               front_end);
  const Mapper mapper = request.online ? map_online(run) : map_offline(run);
  output.add_skipped(recording->skipped());
  output.add_skipped(front_end.skipped());
  bool partial = interrupt.ending();
  if (mapper.trajectory().empty()) {
    throw Error(request.input + ": found no scan and no depth frame that could be used (" +
                output.skipped_text() + "), expected at least one");
  }
  if (cameras.no_ground && front_end.floors_as_stated().hardly_any()) {
    const Warning& unseen = *cameras.no_ground;
    if (!unseen.id.empty()) output.metrics.warn(unseen.id, unseen.text);
    output.draw_no_ground();
  }
  output.set_clocks(clocks);
  output.set_restamped(recording->restamped());
  output.metrics.counts["checkpoints"] = static_cast<double>(checkpoint.saves());
  if (front_end.met_wheels()) output.wheel_path.tell(front_end.wheel_errors_left(), output.metrics);
  front_end.tell_scanner_noise(output.metrics);
  io::write_atomically(request.output / "calibration_found.yaml",
                       calibration_found(output.mountings.over(sensors), output.metrics));
  partial = !output.write(mapper, request.online) || partial;
  if (request.online && !live && !partial)
    warn_of_scanner(*run.open_again(), settings, ended, output.metrics);
  if (partial) warn_of_end(*recording, output.metrics);
  warn_of_result(request.input, *recording, front_end, output.metrics);
  output.finish();
  if (!live && !partial) checkpoint.finish();
  interrupt.all_is_written();
  if (page) page->finished(request.output);
  fmt::print("{}", output.summary());
  const std::vector<Warning>& warnings = output.metrics.warnings;
  if (output.metrics.counts["planes"] == 0 && !partial && !interrupt.interrupted()) {
    throw Error(fmt::format(
        "{}: found no plane in {:.0f} frames and scans ({}{}), expected walls or floor that "
        "several of them see; the files written hold none",
        request.input, output.metrics.counts["steps"], output.skipped_text(),
        warnings.empty() ? "" : "; " + warnings.front().text));
  }
  const auto skipped = recording->skipped();
  for (const auto& [why, place] : recording->first_skipped()) {
    spdlog::warn("skipped {} x {}, first {}", skipped.at(why), why, place);
  }
  for (const Warning& warning : warnings) spdlog::warn(warning.text);
  return 0;
}

}  // namespace lamina::apps
