// `lamina scan`: depth to laser scans, no mapping.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <ostream>

#include <lamina/apps/combined_scan.hpp>
#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/settings.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/apps/wheel_track.hpp>
#include <lamina/frontend/floor/floor_frontend.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/scan_files.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {
namespace {

struct Converted {
  std::int64_t frames = 0, lidar_scans = 0, without_floor = 0, negative_beams = 0;
  bool whole = true;
};

void write_causes(std::ostream& out, const ObstacleScan& scan) {
  out << scan.stamp.to_string();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    out << fmt::format(",{},{:.4f}", to_string(scan.cause[i]), scan.sigma[i]);
  }
  out << '\n';
}

std::optional<DepthFrame> depth_of(const Measurement& measurement) {
  if (const auto* depth = std::get_if<DepthFrame>(&measurement)) return *depth;
  if (const auto* pair = std::get_if<StereoFrame>(&measurement)) return depth_from_stereo(*pair);
  return std::nullopt;
}

Converted convert(Recording& recording, const Settings& settings, InterruptGuard& interrupt,
                  std::ostream& scans, std::ostream& causes) {
  FloorFrontend floor_front_end(settings.floor);
  ObstacleScanner scanner(scan_options(settings));
  CombinedScan combined;
  WheelTrack wheels(recording.calibration().odometry);
  const auto place = [&](Timestamp stamp) { return wheels.at(stamp).value_or(SE3()); };
  Converted counts;
  io::write_scan_header(scans);
  causes << "# timestamp, then cause and sigma (m) of each beam\n";
  while (const auto measurement = recording.next()) {
    if (interrupt.interrupted()) {
      counts.whole = false;
      break;
    }
    if (const auto* odometry = std::get_if<Odometry>(&*measurement)) wheels.add(*odometry);
    if (const auto* lidar = std::get_if<LaserScan>(&*measurement)) {
      io::write_scan(scans, combined.add(*lidar, CombinedScan::Kind::kLidar, place(lidar->stamp)));
      ++counts.lidar_scans;
    }
    const auto frame = depth_of(*measurement);
    if (!frame) continue;
    const FloorResult floor = floor_front_end.process(*frame);
    const ObstacleScan scan = scanner.process(*frame, floor, floor_front_end.disparities());
    LaserScan line = scan.to_laser_scan();
    line.lidar.T_body_lidar = floor.mounting.T_body_camera * floor.T_body_camera.inverse();
    io::write_scan(scans, combined.add(line, CombinedScan::Kind::kDepth, place(frame->stamp)));
    write_causes(causes, scan);
    ++counts.frames;
    interrupt.something_stands();
    counts.without_floor += floor.status != FloorStatus::kFound;
    for (const BeamCause cause : scan.cause) counts.negative_beams += is_negative(cause);
  }
  return counts;
}

// Of a map's settings: those of the front-ends of depth, and which topics of a bag to read.
void require_used(const std::string& assignment) {
  for (const char* used : {"floor.", "scan.", "topics.",
                           "robot.height_m=", "robot.max_step_m=", "robot.max_slope_deg="}) {
    if (assignment.rfind(used, 0) == 0) return;
  }
  throw Error("--set: found '" + assignment +
              "', which changes no scan, expected floor.*, scan.*, topics.*, robot.height_m, "
              "robot.max_step_m or robot.max_slope_deg");
}

int scan(const std::string& input, const std::filesystem::path& output,
         const std::vector<std::string>& assignments,
         const std::optional<std::filesystem::path>& calibration) {
  Settings settings;
  for (const auto& assignment : assignments) {
    set_assignment(settings, assignment);
    require_used(assignment);
  }
  if (const auto wrong = problems(settings); !wrong.empty()) {
    throw Error("settings: " + wrong.front());
  }
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
  Converted counts;
  io::write_atomically(output, [&](std::ostream& scans) {
    io::write_atomically(causes_file, [&](std::ostream& causes) {
      counts = convert(*recording, settings, interrupt, scans, causes);
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
