// `lamina simulate`: a dataset folder with known truth.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/progress.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/nearest.hpp>
#include <lamina/sim/dataset.hpp>
#include <lamina/sim/settings.hpp>

namespace lamina::apps {
namespace {

struct SimulateOptions {
  std::string scene, output, format = "folder";
  std::vector<std::string> assignments;
  std::uint64_t seed = 1;
  double duration = 0;
  bool list = false, labels = false, quiet = false;
};

// A name that is neither a scene nor a file: perhaps one was meant.
void require_scene(const std::string& scene) {
  if (std::filesystem::exists(scene)) return;
  std::vector<std::string> names;
  for (const auto& [name, text] : sim::scene_list()) names.push_back(name);
  if (std::find(names.begin(), names.end(), scene) != names.end()) return;
  const std::string near = nearest(scene, names);
  throw Error("simulate: unknown scene '" + scene + "'" +
              (near.empty() ? ", expected a name of `lamina simulate --list` or a scene YAML"
                            : did_you_mean(near)));
}

int simulate(const SimulateOptions& o) {
  if (o.list) {
    for (const auto& [name, text] : sim::scene_list()) fmt::print("{:<16} {}\n", name, text);
    return kDone;
  }
  if (o.scene.empty())
    throw Error("simulate: found no SCENE, expected a name of `--list` or a scene YAML");
  if (o.output.empty()) throw Error("simulate: found no --output, expected a folder");
  if (!(o.duration >= 0 && std::isfinite(o.duration))) {
    throw Error(fmt::format("--duration: found '{}', expected seconds, 0 for all", o.duration));
  }
  require_scene(o.scene);
  sim::World world = sim::load_scene(o.scene, sim::parse_parameters(o.assignments));
  InterruptGuard interrupt(InterruptGuard::Kind::kWithinASecond,
                           "warning: interrupted before the first measurement",
                           "warning: interrupted: " + o.output + " is no whole recording");
  std::optional<Progress> progress;
  sim::DatasetOptions options;
  options.seed = o.seed;
  options.labels = o.labels;
  options.format = sim::dataset_format(o.format);
  options.max_duration = o.duration;
  options.progress = [&](std::int64_t done, std::int64_t all) {
    if (!progress) progress.emplace(all, o.quiet);
    progress->update(done, 0);
    interrupt.something_stands();
    return !interrupt.interrupted();
  };
  const sim::DatasetCounts counts = sim::write_dataset(std::move(world), o.output, options);
  if (progress) progress->finish();
  if (interrupt.interrupted())
    fmt::print(stderr, "warning: interrupted: {} ends early\n", o.output);
  interrupt.all_is_written();
  fmt::print("{}: {} depth frames, {} stereo pairs, {} scans, {} odometry poses\n", o.output,
             counts.depth_frames, counts.stereo_pairs, counts.scans, counts.odometry);
  return kDone;
}

}  // namespace

Verb simulate_verb() {
  return {"simulate", "writes a simulated recording with its truth",
          "lamina simulate room --output data/room --seed 3", [](CLI::App& app) {
            auto o = std::make_shared<SimulateOptions>();
            auto* scene =
                app.add_option("SCENE", o->scene, "name of a built-in scene, or a scene YAML");
            auto* output = app.add_option("-o,--output", o->output, "dataset folder to write");
            app.add_option(
                "--format", o->format,
                "folder (the default), bag (ROS 1), db3 or mcap (ROS 2) of the recording");
            app.add_option("--seed", o->seed, "seed of noise and drift")
                ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
            app.add_option("--set", o->assignments, "key=value, as often as needed")->take_all();
            app.add_option("--duration", o->duration, "s of the path to drive; 0: all");
            app.add_flag("--list", o->list, "names the scenes")->excludes(scene)->excludes(output);
            app.add_flag("--labels", o->labels, "also write the true plane of each depth pixel");
            app.add_flag("--quiet", o->quiet, "no progress");
            return [o]() { return simulate(*o); };
          }};
}

}  // namespace lamina::apps
