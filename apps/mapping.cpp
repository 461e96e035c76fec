// The straight line of the program: recording, front-end, mapper, refiner, files.
#include <lamina/apps/mapping.hpp>

#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <lamina/apps/calibration.hpp>
#include <lamina/apps/camera_checks.hpp>
#include <lamina/apps/camera_clock.hpp>
#include <lamina/apps/checkpoint.hpp>
#include <lamina/apps/doubts.hpp>
#include <lamina/apps/first_looks.hpp>
#include <lamina/apps/front_end.hpp>
#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/live.hpp>
#include <lamina/apps/map_output.hpp>
#include <lamina/apps/map_steps.hpp>
#include <lamina/apps/odometry_units.hpp>
#include <lamina/apps/preset.hpp>
#include <lamina/apps/run_warnings.hpp>
#include <lamina/apps/scanner_calibration.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/sealed_file.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/corrected_recording.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina::apps {
namespace {

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

namespace {

// What is mapped, opened as often as it takes, with what was found wrong with it put right.
class Input {
 public:
  Input(const MapRequest& request, const std::function<bool()>& ended)
      : request_(request), live_(is_live(request)) {
    options_.topics = chosen_topics(settings_of(request));
    options_.calibration = request.calibration;
    recording = open();
    sensors = recording->calibration();
    settings = settings_of(request, &sensors);
    max_tilt_ = settings.scan_odometry.max_tilt;
    spdlog::info("preset {}", settings.preset);
    clocks = {-settings.scanner_delay, -settings.camera_delay, -settings.odometry_delay};
    if (!live_ && (sensors.depth_camera || sensors.stereo_camera)) check(ended);
  }

  static bool is_live(const MapRequest& request) { return request.input.rfind("openni:", 0) == 0; }
  bool live() const { return live_; }
  bool offline() const { return !request_.online && !live_; }

  std::unique_ptr<Recording> open() const { return open_in(units_); }

  // What was found so far.
  void note(io::Metrics& metrics) const {
    for (const Warning& found : cameras.warnings) metrics.warn(found.id, found.text);
    note_clocks(clocks, settings, metrics);
  }

  std::unique_ptr<Recording> recording;
  Calibration sensors;
  Settings settings;
  ClockOffsets clocks;
  ScanCorrection scanner;
  CameraFindings cameras;

 private:
  std::unique_ptr<Recording> open_in(const OdometryUnits& units) const {
    return std::make_unique<CorrectedRecording>(
        corrected(open_recording(request_.input, options_), cameras.fixes), scanner, max_tilt_,
        units);
  }

  void check(const std::function<bool()>& ended) {
    cameras = check_cameras(*recording, settings.floor, ended);
    settings.floor.self_calibrate = settings.floor.self_calibrate && !cameras.floor_uneven;
    recording.reset();
    if (sensors.odometry.planar && !cameras.fixes.drop_depth)
      units_ = look_at_odometry_units([this](const OdometryUnits& units) { return open_in(units); },
                                      settings, cameras.warnings, ended);
    look_at_camera_clock([this] { return open(); }, sensors, clocks, settings, cameras.warnings,
                         ended);
    recording = open();
    sensors = recording->calibration();
  }

  const MapRequest& request_;
  bool live_;
  RecordingOptions options_;
  double max_tilt_ = Settings().scan_odometry.max_tilt;
  OdometryUnits units_;
};

// What needs no look ahead is found on the way.
void set_up(FrontEnd& front_end, const MapRequest& request, const Input& input) {
  if (input.live() && request.resume)
    throw Error("--resume: found the live device " + request.input + ", expected a recording");
  const Settings& settings = input.settings;
  if (request.online && settings.follow_slopes) front_end.follow_slopes();
  if (request.online && settings.images_beside_wheels) front_end.ask_images_beside_wheels();
  if (!input.offline() && settings.find_sweep && settings.sweep == 0) front_end.watch_for_sweep();
}

void require_nonempty(const MapRequest& request, const Mapper& mapper, const MapOutput& output) {
  if (!mapper.trajectory().empty()) return;
  throw Error(request.input + ": found no scan and no depth frame that could be used (" +
              output.skipped_text() + "), expected at least one");
}

// What the run ended with, into files and metrics. Whether all of it was written.
bool write_results(const MapRequest& request, const Input& input, const Mapper& mapper,
                   FrontEnd& front_end, const Checkpoint& checkpoint, Run& run) {
  MapOutput& output = run.output;
  io::Metrics& metrics = output.metrics;
  if (input.cameras.no_ground && front_end.floors_as_stated().hardly_any()) {
    const Warning& unseen = *input.cameras.no_ground;
    if (!unseen.id.empty()) metrics.warn(unseen.id, unseen.text);
    output.draw_no_ground();
  }
  output.set_clocks(input.clocks);
  output.set_restamped(input.recording->restamped());
  metrics.counts["checkpoints"] = static_cast<double>(checkpoint.saves());
  if (front_end.met_wheels()) output.wheel_path.tell(front_end.wheel_errors_left(), metrics);
  front_end.tell_scanner_noise(metrics);
  io::write_atomically(request.output / "calibration_found.yaml",
                       calibration_found(output.mountings.over(input.sensors), metrics));
  const bool interrupted = run.interrupt.ending();
  const bool partial = !output.write(mapper, request.online) || interrupted;
  if (request.online && !input.live() && !partial)
    warn_of_scanner(
        *run.open_again(), input.settings, [&run] { return run.interrupt.interrupted(); }, metrics);
  if (partial) warn_of_end(*input.recording, metrics);
  warn_of_result(request.input, *input.recording, front_end, metrics);
  output.finish();
  return !partial;
}

void require_planes(const MapRequest& request, MapOutput& output) {
  if (output.metrics.counts["planes"] != 0) return;
  std::string causes, more;
  for (const Warning& warning : output.metrics.warnings) {
    if (causes.empty()) {
      causes = "; " + warning.text;
    } else {
      more += (more.empty() ? "; also: " : ", ") + warning.id;
    }
  }
  throw Error(fmt::format(
      "{}: found no plane in {:.0f} frames and scans ({}{}{}), expected walls or floor that "
      "several of them see; the files written hold none",
      request.input, output.metrics.counts["steps"], output.skipped_text(), causes, more));
}

void log_warnings(const Recording& recording, const io::Metrics& metrics) {
  const auto skipped = recording.skipped();
  for (const auto& [why, place] : recording.first_skipped()) {
    spdlog::warn("skipped {} x {}, first {}", skipped.at(why), why, place);
  }
  for (const Warning& warning : metrics.warnings) spdlog::warn(warning.text);
}

}  // namespace

int run_map(const MapRequest& request) {
  set_up_log(request.quiet);
  InterruptGuard interrupt = guard(request, Input::is_live(request));
  const auto ended = [&] { return interrupt.interrupted(); };
  Input input(request, ended);
  const Settings& settings = input.settings;
  io::make_results_folder(request.output);
  MapOutput output(request.output, settings);
  output.set_recording(request.input);
  input.note(output.metrics);
  FrontEnd front_end(settings, input.sensors);
  output.end_with(interrupt);
  set_up(front_end, request, input);
  Checkpoint checkpoint(request.output, identity(request, settings), settings.checkpoint_interval);
  if (request.resume) checkpoint.require_same_run();
  Run run{input.recording,
          front_end,
          settings,
          output,
          input.live() ? nullptr : &checkpoint,
          interrupt,
          request.resume,
          request.quiet,
          request.online};
  run.closer.keep_submaps_in(output.folder());
  std::optional<LivePage> page;
  if (request.live) {
    run.live = &page.emplace(*request.live, request.input);
    fmt::print(stderr, "live map: {}\n", page->url());
  }
  note_assumed(*input.recording, output.metrics);
  const OpenReclocked open_reclocked = [&](const ClockOffsets& offsets) {
    ++output.metrics.readings;
    return reclocked(input.open(), offsets);
  };
  output.metrics.readings = 1;
  if (!input.live()) run.open_again = [&] { return open_reclocked(input.clocks); };
  if (run.open_again && input.clocks.any()) {
    input.recording.reset();
    input.recording = run.open_again();
  }
  if (input.offline())
    look_ahead({input.recording, run.open_again, open_reclocked, input.clocks, input.scanner,
                settings, output.metrics, ended},
               front_end);
  const Mapper mapper = request.online ? map_online(run) : map_offline(run);
  output.add_skipped(input.recording->skipped());
  output.add_skipped(front_end.skipped());
  require_nonempty(request, mapper, output);
  const bool whole = write_results(request, input, mapper, front_end, checkpoint, run);
  if (!input.live() && whole) checkpoint.finish();
  interrupt.all_is_written();
  if (page) page->finished(request.output);
  fmt::print("{}", output.summary());
  if (whole && !interrupt.interrupted()) require_planes(request, output);
  log_warnings(*input.recording, output.metrics);
  return 0;
}

}  // namespace lamina::apps
