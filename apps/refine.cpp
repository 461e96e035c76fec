// `lamina refine`: solves again what is already a graph.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>

#include <lamina/apps/run_display.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/settings.hpp>
#include <lamina/pipeline/evaluation/solver_benchmark.hpp>
#include <lamina/pipeline/refine_sessions.hpp>
#include <lamina/pipeline/write_results.hpp>
#include <lamina/viewer/report.hpp>

namespace lamina::apps {
namespace {

using Assignments = std::vector<std::string>;

void assign(MapOptions& options, const Assignments& assignments) {
  for (const auto& assignment : assignments) set_assignment(options, assignment);
  if (const auto wrong = problems(options); !wrong.empty()) {
    throw Error("settings: " + wrong.front());
  }
}

int refine(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& output,
           const Assignments& assignments, bool quiet) {
  set_up_log(quiet);
  InterruptGuard interrupt(InterruptGuard::Kind::kWithinASecond,
                           "warning: interrupted: nothing was written, the maps are as they were",
                           "warning: interrupted: there was no time to write the map; the maps it "
                           "was made from are as they were");
  RunDisplay display(interrupt, quiet, nullptr, output);
  const auto options_of_text = [&](const std::string& yaml, const std::string& name) {
    MapOptions options;
    load_text(options, yaml, name);
    assign(options, assignments);
    options.to_yaml = &to_yaml;
    options.command = command_line();
    return options;
  };
  const MapResult result = refine_sessions(inputs, options_of_text, output, display);
  const WrittenResults written = write_results(output, result, display);
  viewer::write_report(output);
  for (const Warning& warning : result.diagnostics().warnings) spdlog::warn(warning.text);
  interrupt.all_is_written();
  fmt::print("{}", written.summary);
  return 0;
}

// A benchmark problem: signals end the iterations, what stands is written.
int solve(const std::filesystem::path& input, const std::filesystem::path& output, bool online,
          std::optional<int> keyframes, const Assignments& assignments) {
  MapOptions options;
  assign(options, assignments);
  WindowOptions& window = options.mapper.window;
  window.keyframes = keyframes.value_or(window.keyframes);
  InterruptGuard interrupt(InterruptGuard::Kind::kWithinASecond, "",
                           "warning: interrupted: there was no time to write the poses");
  interrupt.something_stands();
  const RunDisplay display(interrupt, true, nullptr);
  const SolvedBenchmark solved =
      solve_benchmark(input, output, window, online, [&display] { return display.hurried(); });
  fmt::print("{}\n", solved.summary);
  return solved.converged ? 0 : 1;
}

}  // namespace

Verb refine_verb() {
  return {"refine", "re-optimises saved maps and joins several into one; or solves a .planegraph",
          "lamina refine out/monday out/tuesday --output out/both", [](CLI::App& app) {
            struct Options {
              std::vector<std::string> inputs, assignments;
              std::string output, mode = "offline";
              std::optional<int> keyframes;
              bool quiet = false;
            };
            auto o = std::make_shared<Options>();
            app.add_option("INPUT", o->inputs,
                           "output folders of `map` (several are joined), or FILE.planegraph")
                ->required();
            app.add_option("-o,--output", o->output, "folder for the results")->required();
            app.add_option("--mode", o->mode,
                           "offline: the whole graph; online: the window (.planegraph alone)")
                ->check(CLI::IsMember({"offline", "online"}));
            app.add_option("--keyframes", o->keyframes,
                           "keyframes in the window of --mode online; 20")
                ->check(CLI::Range(3, 100000));
            app.add_option("--set", o->assignments, "key=value, as often as needed")->take_all();
            app.add_option_function<std::string>(
                "--threads", [o](auto& n) { o->assignments.push_back("threads=" + n); }, "threads");
            app.add_flag("--quiet", o->quiet, "warnings only");
            return [o]() {
              const std::filesystem::path input = o->inputs.front();
              const bool problem = input.extension() == ".planegraph", online = o->mode == "online";
              if (online && !problem) {
                throw Error("--mode: found 'online' for " + input.string() +
                            ", expected offline: a saved map is refined as a whole");
              }
              if (o->keyframes && !online) {
                throw Error("--keyframes: found without a window, expected with --mode online");
              }
              if (!problem) {
                return refine({o->inputs.begin(), o->inputs.end()}, o->output, o->assignments,
                              o->quiet);
              }
              if (o->inputs.size() != 1) {
                throw Error(o->inputs[1] + ": a .planegraph is solved alone, expected one input");
              }
              return solve(input, o->output, online, o->keyframes, o->assignments);
            };
          }};
}

}  // namespace lamina::apps
