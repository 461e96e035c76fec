// `lamina map`: a recording in, a map out.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>

#include <lamina/apps/run_display.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/pipeline/config/map_request.hpp>
#include <lamina/pipeline/map.hpp>
#include <lamina/pipeline/publish/published_run.hpp>
#include <lamina/pipeline/require_planes.hpp>
#include <lamina/pipeline/write_results.hpp>
#include <lamina/sensors/readers/input_kind.hpp>
#include <lamina/viewer/report.hpp>

namespace lamina::apps {
namespace {

struct MapCommand : MapRequest {
  bool quiet = false;
  std::optional<std::string> live;  ///< [ADDRESS:]PORT of the page to look on, empty: the default
  bool publish = false;             ///< to ROS 2
  double rate = 1;                  ///< times real time, of a file that is replayed
};

// What signals do, and what is said where they leave no time to write.
InterruptGuard guard(const MapCommand& command) {
  const bool live = is_live(command.input);
  const std::string again = command.resume ? "the same command" : "the same command with --resume";
  return {live ? InterruptGuard::Kind::kEndsReading : InterruptGuard::Kind::kWithinASecond,
          std::string("warning: interrupted before there was a map: nothing was written, ") +
              (command.resume ? "the checkpoint is as it was" : "the same command begins anew"),
          "warning: interrupted: there was no time to write the map; " + again +
              " goes on from the last checkpoint"};
}

int run(MapCommand& command) {
  set_up_log(command.quiet);
  InterruptGuard interrupt = guard(command);
  command.ended = [&interrupt] { return interrupt.interrupted(); };
  auto [source, options] = requested(command);
  options.command = command_line();
  for (const std::string& line : options.former_names) spdlog::warn(line);
  io::make_results_folder(command.output);
  std::optional<LivePage> page;
  if (command.live) {
    page.emplace(*command.live, command.input);
    fmt::print(stderr, "live map: {}\n", page->url());
  }
  RunDisplay display(interrupt, command.quiet, page ? &*page : nullptr, command.output);
  std::optional<PublishedRun> published;
  if (command.publish) published.emplace(source, options, command.rate, display);
  RunObserver& observer = published ? static_cast<RunObserver&>(*published) : display;
  const MapResult result = map(source, options, observer);
  const WrittenResults written = write_results(command.output, result, display);
  if (published) published->finished(result);
  viewer::write_report(command.output);
  const bool whole = written.whole && !result.stopped;
  interrupt.all_is_written();
  if (page) page->finished(command.output);
  fmt::print("{}", written.summary);
  if (whole && !interrupt.interrupted()) require_planes(result);
  for (const std::string& line : result.notes) spdlog::warn(line);
  for (const Warning& warning : result.diagnostics().warnings) spdlog::warn(warning.text);
  return 0;
}

}  // namespace

Verb map_verb() {
  return {
      "map", "maps a recording, a live sensor or a running ROS 2 robot",
      "lamina map recording.log --output out/recording --set window.keyframes=30",
      [](CLI::App& app) {
        auto request = std::make_shared<MapCommand>();
        auto mode = std::make_shared<std::string>("offline");
        app.add_option("INPUT", request->input, kInputKinds)->required();
        app.add_option("-o,--output", request->output, "folder for the results")->required();
        app.add_option("--config", request->config, "YAML file of settings");
        app.add_option("--calibration", request->calibration,
                       "YAML file of sensors: what it states replaces what INPUT says");
        app.add_option("--preset", request->preset,
                       "indoor_rgbd, wheeled_lidar or aerial_lidar; else by what INPUT holds");
        app.add_option("--set", request->assignments, "key=value, as often as needed")->take_all();
        app.add_option("--mode", *mode, "offline: refine all at the end; online: as a robot")
            ->check(CLI::IsMember({"offline", "online"}));
        app.add_option("--seed", request->seed, "seed of everything random")
            ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
        app.add_option("--threads", request->threads, "threads; results do not depend on it");
        app.add_flag("--resume", request->resume, "go on from the last checkpoint");
        app.add_flag("--quiet", request->quiet, "no progress, warnings only");
        app.add_flag("--publish", request->publish, "the map to ROS 2 while it grows (online)");
        app.add_option("--rate", request->rate, "times real time that --publish replays a file at")
            ->check(CLI::PositiveNumber);
        auto live = std::make_shared<std::string>();
        const auto* live_flag =
            app.add_flag("--live{}", *live,
                         "shows the map in a browser while it grows; --live=[ADDRESS:]PORT: where");
        return [request, mode, live, live_flag]() {
          request->online = *mode == "online" || request->publish;
          if (live_flag->count() > 0) request->live = *live;
          return run(*request);
        };
      }};
}

}  // namespace lamina::apps
