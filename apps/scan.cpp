// `lamina scan`: depth to laser scans, no mapping.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <ostream>

#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/settings.hpp>
#include <lamina/pipeline/obstacle_scans.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {
namespace {

// Of a map's settings: those of the front-ends of depth, and which topics of a bag to read.
void require_used(const std::string& assignment) {
  for (const char* used : {"floor.", "obstacles.", "scan.", "topics.",
                           "robot.height_m=", "robot.max_step_m=", "robot.max_slope_deg="}) {
    if (assignment.rfind(used, 0) == 0) return;
  }
  throw Error("--set: found '" + assignment +
              "', which changes no scan, expected floor.*, obstacles.*, topics.*, robot.height_m, "
              "robot.max_step_m or robot.max_slope_deg");
}

int scan(const std::string& input, const std::filesystem::path& output,
         const std::vector<std::string>& assignments,
         const std::optional<std::filesystem::path>& calibration) {
  MapOptions settings;
  for (const auto& assignment : assignments) {
    set_assignment(settings, assignment);
    require_used(assignment);
  }
  if (const auto wrong = problems(settings); !wrong.empty()) {
    throw Error("settings: " + wrong.front());
  }
  for (const std::string& line : settings.former_names) fmt::print(stderr, "warning: {}\n", line);
  InterruptGuard interrupt(InterruptGuard::Kind::kWithinASecond,
                           "warning: interrupted before the first scan: nothing was written",
                           "warning: interrupted: there was no time to write the scans");
  RecordingOptions options;
  options.topics = chosen_topics(settings);
  options.calibration = calibration;
  const auto recording = open_recording(input, options);
  std::filesystem::path causes_file = output;
  causes_file.replace_filename(output.stem().string() + "_causes.csv");
  const bool recording_there = std::filesystem::exists(output.parent_path() / "calibration.yaml");
  for (const auto& file : {output, causes_file}) {
    if (recording_there && std::filesystem::exists(file)) {
      throw Error(file.string() + ": found a file of a recording, expected another name");
    }
    if (std::filesystem::is_directory(file)) {
      throw Error(file.string() + ": found a folder, expected the name of a file to write");
    }
  }
  if (output.has_parent_path()) io::make_output_folder(output.parent_path());
  ObstacleScanCounts counts;
  io::write_atomically(output, [&](std::ostream& scans) {
    io::write_atomically(causes_file, [&](std::ostream& causes) {
      counts = write_obstacle_scans(
          *recording, settings,
          [&interrupt] {
            interrupt.something_stands();
            return interrupt.interrupted();
          },
          scans, causes);
      if (counts.frames == 0) {
        throw Error(input + ": found no depth image and no stereo pair, expected at least one");
      }
    });
  });
  if (!counts.whole)
    fmt::print(stderr, "warning: interrupted: {} holds the recording's first {} images alone\n",
               output.string(), counts.frames);
  fmt::print(
      "{}: {} scans of depth, {} without a floor, {} beams that end at a hole or ledge; {} lidar "
      "scans\n",
      output.string(), counts.frames, counts.without_floor, counts.negative_beams,
      counts.lidar_scans);
  return kDone;
}

}  // namespace

Verb scan_verb() {
  return {
      "scan", "depth images (and a 2D lidar) to scans of positive and negative obstacles",
      "lamina scan data/corridor --output out/scans.csv", [](CLI::App& app) {
        auto input = std::make_shared<std::string>();
        auto output = std::make_shared<std::string>();
        auto assignments = std::make_shared<std::vector<std::string>>();
        app.add_option("INPUT", *input, "recording with depth images or stereo pairs")->required();
        app.add_option("-o,--output", *output, "FILE.csv; causes and sigmas go to FILE_causes.csv")
            ->required();
        app.add_option("--set", *assignments, "key=value, as often as needed")->take_all();
        auto calibration = std::make_shared<std::optional<std::filesystem::path>>();
        app.add_option("--calibration", *calibration,
                       "YAML file of sensors: what it states replaces what INPUT says");
        return [=]() { return scan(*input, *output, *assignments, *calibration); };
      }};
}

}  // namespace lamina::apps
