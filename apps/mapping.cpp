// The straight line of the program: recording, front-end, mapper, refiner, files.
#include <lamina/apps/mapping.hpp>

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include <lamina/apps/calibration.hpp>
#include <lamina/apps/checkpoint.hpp>
#include <lamina/apps/dead_reckoning.hpp>
#include <lamina/apps/doubts.hpp>
#include <lamina/apps/first_looks.hpp>
#include <lamina/apps/front_end.hpp>
#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/live.hpp>
#include <lamina/apps/loop_book.hpp>
#include <lamina/apps/map_output.hpp>
#include <lamina/apps/mounting_doubt.hpp>
#include <lamina/apps/preset.hpp>
#include <lamina/apps/progress.hpp>
#include <lamina/apps/steps.hpp>
#include <lamina/backend/mapper.hpp>
#include <lamina/backend/online_upkeep.hpp>
#include <lamina/backend/refiner.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {
namespace {

void refine(Mapper& mapper, MapOutput& output, const std::function<bool()>& ended) {
  const Trajectory before = mapper.trajectory();
  const RefineResult result = mapper.refine({}, [&](const RefineProgress&) { return !ended(); });
  {
    const auto timer = output.metrics.time("covariances");
    mapper.know_covariances();
  }
  output.set_refinement(result, before, mapper.trajectory());
  // Nothing to solve is no plane, too: that is said once.
  if (result.status != SolveStatus::kConverged && result.status != SolveStatus::kNothingToSolve)
    spdlog::warn("refinement: {}", to_string(result.status));
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
  if (settings.close_loops) gather(run.closer.finish());
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
  if (settings.calibrate_mountings)
    doubt.hear(correct_mountings(steps, loops, run.front_end.met_wheels(), output.metrics));
  // Where reading was ended, what was read is mapped all the same.
  const bool ended_before = run.interrupt.interrupted();
  const auto ended = [&] { return run.interrupt.interrupted() && !ended_before; };
  const bool wheels = run.front_end.met_wheels();
  if (settings.calibrate_wheels && wheels) {
    const auto sigmas =
        correct_wheels(steps, options, settings.calibrate_mountings, output.metrics, ended);
    if (sigmas) output.wheel_path.know(*sigmas);
  }
  if (run.open_again && settings.images_beside_wheels && run.front_end.met_odometry()) {
    doubt.hear(correct_motions_by_images(run.open_again, run.front_end.depth_distortion(), steps,
                                         settings.calibrate_mountings && wheels, output.metrics,
                                         ended));
  }
  if (run.open_again && settings.follow_slopes && run.front_end.slopes_seen() > 0)
    options.window_trusts_tilt = !lift_off_plane(run.open_again, run.front_end.depth_distortion(),
                                                 steps, output.metrics, ended);
  Mapper mapper(options);
  LoopBook book;
  Progress progress(static_cast<std::int64_t>(steps.size()), run.quiet);
  std::int64_t mapped = 0;
  for (const Step& step : steps) {
    if (ended()) break;
    map_step(step, mapper, run.closer, book, output);
    progress.update(++mapped, plane_count(mapper));
    if (!run.live) continue;
    run.live->progress(mapped, static_cast<std::int64_t>(steps.size()));
    run.live->mapped(step, mapper, output.metrics);
  }
  progress.finish();
  output.metrics.counts["scan_loops"] = book.hand_over(loops, mapper);
  if (run.live) run.live->refining(mapper, output.metrics);
  refine(mapper, output, ended);
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
  {
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

// What a checkpoint must have in common with the run that goes on from it; what changes no result
// is left out.
std::string identity(const MapRequest& request, Settings settings) {
  settings.threads = 1;
  settings.checkpoint_interval = 30;
  return "input: " + std::filesystem::weakly_canonical(request.input).string() +
         "\nrecording: " + extent_of(request.input) +
         "\nmode: " + (request.online ? "online" : "offline") + "\n" + to_yaml(settings, false);
}

// What makes the result doubtful, by the reader first: causes before consequences.
void warn_of_result(const std::string& input, const Recording& recording, const FrontEnd& front_end,
                    io::Metrics& metrics) {
  const auto warn = [&metrics](std::vector<Warning> found) {
    for (Warning& one : found) metrics.warn(std::move(one.id), std::move(one.text));
  };
  warn(recording.warnings());
  warn(doubts(input, front_end, metrics));
}

}  // namespace

void set_up_log(bool quiet) {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "lamina", std::make_shared<spdlog::sinks::stderr_color_sink_mt>()));
  spdlog::set_pattern("%^%l%$: %v");
  spdlog::set_level(quiet ? spdlog::level::warn : spdlog::level::info);
}

Settings settings_of(const MapRequest& request, const Calibration* sensors) {
  const auto all_over = [&request](Settings settings) {
    if (request.config) load(settings, *request.config);
    for (const auto& assignment : request.assignments) set_assignment(settings, assignment);
    if (request.preset) set(settings, "preset", *request.preset, "--preset");
    if (request.seed) settings.seed = *request.seed;
    if (request.threads) settings.threads = *request.threads;
    const auto wrong = problems(settings);
    if (!wrong.empty()) throw Error("settings: " + wrong.front());
    return settings;
  };
  const Settings asked = all_over({});
  const Preset* preset = find_preset(asked.preset);
  if (preset == nullptr && sensors) preset = &preset_for(*sensors, asked.scan_odometry.max_tilt);
  if (preset == nullptr) return asked;
  Settings base;
  apply(*preset, base);
  Settings settings = all_over(std::move(base));
  settings.preset = preset->name;
  return settings;
}

int run_map(const MapRequest& request) {
  set_up_log(request.quiet);
  RecordingOptions options;
  options.topics = chosen_topics(settings_of(request));
  auto recording = open_recording(request.input, options);
  const Calibration sensors = recording->calibration();
  const Settings settings = settings_of(request, &sensors);
  spdlog::info("preset {}", settings.preset);
  io::make_results_folder(request.output);
  MapOutput output(request.output, settings);
  output.set_recording(request.input);
  FrontEnd front_end(settings, sensors);
  const bool live = request.input.rfind("openni:", 0) == 0;
  if (request.online && settings.follow_slopes) front_end.follow_slopes();
  if (request.online && settings.images_beside_wheels) front_end.ask_images_beside_wheels();
  if (live && request.resume) {
    throw Error("--resume: found the live device " + request.input + ", expected a recording");
  }
  Checkpoint checkpoint(request.output, identity(request, settings), settings.checkpoint_interval);
  if (request.resume) checkpoint.require_same_run();
  Run run{recording,      front_end,     settings,      output, live ? nullptr : &checkpoint,
          request.resume, request.quiet, request.online};
  run.closer.keep_submaps_in(output.folder());
  std::optional<LivePage> page;
  if (request.live) {
    run.live = &page.emplace(*request.live, request.input);
    fmt::print(stderr, "live map: {}\n", page->url());
  }
  ClockOffsets clocks{-settings.scanner_delay, -settings.camera_delay, -settings.odometry_delay};
  const OpenReclocked open_reclocked = [&](const ClockOffsets& offsets) {
    auto source = open_recording(request.input, options);
    if (!offsets.any()) return source;
    return std::unique_ptr<Recording>(
        std::make_unique<ReclockedRecording>(std::move(source), offsets));
  };
  if (!live) run.open_again = [&] { return open_reclocked(clocks); };
  if (!live && clocks.any()) {
    recording.reset();
    recording = run.open_again();
  }
  const auto ended = [&] { return run.interrupt.interrupted(); };
  const bool offline = !request.online && !live;
  if (!offline && settings.find_sweep && settings.sweep == 0) front_end.watch_for_sweep();
  if (offline)
    look_ahead({recording, run.open_again, open_reclocked, clocks, settings, output.metrics, ended},
               front_end);
  const Mapper mapper = request.online ? map_online(run) : map_offline(run);
  output.add_skipped(recording->skipped());
  output.add_skipped(front_end.skipped());
  const bool interrupted = run.interrupt.interrupted();
  if (mapper.trajectory().empty() && interrupted)
    throw std::runtime_error("interrupted before the first pose: nothing was written");
  if (mapper.trajectory().empty()) {
    throw Error(request.input + ": found no scan and no depth frame that could be used (" +
                output.skipped_text() + "), expected at least one");
  }
  output.set_clocks(clocks);
  output.metrics.counts["checkpoints"] = static_cast<double>(checkpoint.saves());
  if (front_end.met_wheels()) output.wheel_path.tell(front_end.wheel_errors_left(), output.metrics);
  front_end.tell_scanner_noise(output.metrics);
  output.write(mapper, request.online);
  warn_of_result(request.input, *recording, front_end, output.metrics);
  output.finish();
  if (!live && !interrupted) checkpoint.finish();
  if (page) page->finished(request.output);
  fmt::print("{}", output.summary());
  const std::vector<Warning>& warnings = output.metrics.warnings;
  if (output.metrics.counts["planes"] == 0 && !interrupted) {
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
