// Defaults, preset, files, assignments.
#include <lamina/pipeline/config/map_request.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <lamina/io/sealed_file.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/config/preset.hpp>
#include <lamina/pipeline/config/settings.hpp>
#include <lamina/sensors/ros2/live_source.hpp>
#include <lamina/sensors/surface_pixels.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {

MapOptions options_of(const MapRequest& request, const Calibration* sensors) {
  const auto all_over = [&request](MapOptions settings) {
    if (request.config) load(settings, *request.config);
    for (const auto& assignment : request.assignments) set_assignment(settings, assignment);
    if (request.preset) set(settings, "preset", *request.preset, "--preset");
    if (request.seed) settings.seed = *request.seed;
    if (request.threads) settings.threads = *request.threads;
    const auto wrong = problems(settings);
    if (!wrong.empty()) throw Error("settings: " + wrong.front());
    return settings;
  };
  const MapOptions asked = all_over({});
  const Preset* preset = find_preset(asked.preset);
  if (preset == nullptr && sensors) preset = &preset_for(*sensors, asked.scan_odometry.max_tilt);
  if (preset == nullptr) return asked;
  MapOptions base;
  apply(*preset, base);
  MapOptions settings = all_over(std::move(base));
  settings.preset = preset->name;
  settings.to_yaml = &to_yaml;
  return settings;
}

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
std::string identity(const MapRequest& request, MapOptions options) {
  options.threads = 1;
  options.checkpoint_interval = 30;
  return "input: " + std::filesystem::weakly_canonical(request.input).string() +
         "\nrecording: " + extent_of(request.input) +
         "\ncalibration: " + content_of(request.calibration) +
         "\nmode: " + (request.online ? "online" : "offline") + "\n" + to_yaml(options, false);
}

std::unique_ptr<Recording> open_input(const MapRequest& request, const RecordingOptions& options,
                                      RecordingSource& source) {
  if (!ros2::is_live(request.input)) return open_recording(request.input, options);
  ros2::LiveOptions live;
  live.ended = request.ended;
  live.say = [](const std::string& line) { run_log().info(line); };
  live.on_frames = [&source](const std::string& odometry, const std::string& body) {
    if (!odometry.empty()) source.odometry_frame = odometry;
    if (!body.empty()) source.body_frame = body;
  };
  return std::make_unique<SurfacesRecording>(ros2::open_live(request.input, options, live));
}

}  // namespace

bool is_live(const std::string& input) {
  return input.rfind("openni:", 0) == 0 || ros2::is_live(input);
}

Requested requested(const MapRequest& request) {
  Requested result;
  RecordingOptions recording;
  recording.topics = chosen_topics(options_of(request));
  recording.calibration = request.calibration;
  const auto open = [input = request.input, recording] { return open_recording(input, recording); };
  // What is opened to learn of its sensors is handed out first: a device bears no second one.
  const auto first =
      std::make_shared<std::unique_ptr<Recording>>(open_input(request, recording, result.source));
  const Calibration sensors = (*first)->calibration();
  result.source.name = request.input;
  result.source.open = [open, first] { return *first ? std::move(*first) : open(); };
  result.source.live = is_live(request.input);
  MapOptions& options = result.options;
  options = options_of(request, &sensors);
  options.online = request.online || ros2::is_live(request.input);
  options.resume = request.resume;
  options.scratch_folder = options.checkpoint_folder = request.output;
  options.checkpoint_identity = identity(request, options);
  return result;
}

MapOptions preset_options(const Calibration& sensors) { return options_of(MapRequest{}, &sensors); }

}  // namespace lamina
