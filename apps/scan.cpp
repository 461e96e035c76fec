// `lamina scan`: depth to laser scans, no mapping.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <ostream>

#include <lamina/apps/settings.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/frontend/floor/floor_frontend.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/scan_files.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {
namespace {

struct Converted {
  std::int64_t frames = 0, without_floor = 0, negative_beams = 0;
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

Converted convert(Recording& recording, const Settings& settings, std::ostream& scans,
                  std::ostream& causes) {
  FloorFrontend floor_front_end(settings.floor);
  ObstacleScanner scanner;
  Converted counts;
  io::write_scan_header(scans);
  causes << "# timestamp, then cause and sigma (m) of each beam\n";
  while (const auto measurement = recording.next()) {
    const auto frame = depth_of(*measurement);
    if (!frame) continue;
    const FloorResult floor = floor_front_end.process(*frame);
    const ObstacleScan scan = scanner.process(*frame, floor);
    io::write_scan(scans, scan.to_laser_scan());
    write_causes(causes, scan);
    ++counts.frames;
    counts.without_floor += floor.status != FloorStatus::kFound;
    for (const BeamCause cause : scan.cause) counts.negative_beams += is_negative(cause);
  }
  return counts;
}

int scan(const std::string& input, const std::filesystem::path& output,
         const std::vector<std::string>& assignments) {
  Settings settings;
  for (const auto& assignment : assignments) set_assignment(settings, assignment);
  const auto recording = open_recording(input);
  std::filesystem::path causes_file = output;
  causes_file.replace_filename(output.stem().string() + "_causes.csv");
  if (output.has_parent_path()) io::make_output_folder(output.parent_path());
  Converted counts;
  io::write_atomically(output, [&](std::ostream& scans) {
    io::write_atomically(causes_file, [&](std::ostream& causes) {
      counts = convert(*recording, settings, scans, causes);
      if (counts.frames == 0) {
        throw Error(input + ": found no depth image and no stereo pair, expected at least one");
      }
    });
  });
  fmt::print("{}: {} scans, {} without a floor, {} beams that end at a hole or ledge\n",
             output.string(), counts.frames, counts.without_floor, counts.negative_beams);
  return kDone;
}

}  // namespace

Verb scan_verb() {
  return {
      "scan", "depth images to 2D scans of positive and negative obstacles",
      "lamina scan data/corridor --output out/scans.csv", [](CLI::App& app) {
        auto input = std::make_shared<std::string>();
        auto output = std::make_shared<std::string>();
        auto assignments = std::make_shared<std::vector<std::string>>();
        app.add_option("INPUT", *input, "recording with depth images or stereo pairs")->required();
        app.add_option("--output", *output, "FILE.csv; causes and sigmas go to FILE_causes.csv")
            ->required();
        app.add_option("--set", *assignments, "key=value, as often as needed")->take_all();
        return [=]() { return scan(*input, *output, *assignments); };
      }};
}

}  // namespace lamina::apps
