// `lamina map`: options of the verb.
#include <CLI/CLI.hpp>

#include <lamina/apps/mapping.hpp>
#include <lamina/apps/verbs.hpp>

namespace lamina::apps {

Verb map_verb() {
  return {
      "map", "maps a recording or a live sensor",
      "lamina map recording.log --output out/recording --set window.keyframes=30",
      [](CLI::App& app) {
        auto request = std::make_shared<MapRequest>();
        auto mode = std::make_shared<std::string>("offline");
        app.add_option("INPUT", request->input,
                       "dataset folder, .oni, .log, .clf, .rawlog, .bag, .pcd, or openni:[URI]")
            ->required();
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
        auto live = std::make_shared<std::string>();
        const auto* live_flag =
            app.add_flag("--live{}", *live,
                         "shows the map in a browser while it grows; --live=[ADDRESS:]PORT: where");
        return [request, mode, live, live_flag]() {
          request->online = *mode == "online";
          if (live_flag->count() > 0) request->live = *live;
          return run_map(*request);
        };
      }};
}

}  // namespace lamina::apps
