// `lamina refine`: solves again what is already a graph.
#include <CLI/CLI.hpp>

#include <lamina/apps/refine_plane_graph.hpp>
#include <lamina/apps/refine_session.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {

Verb refine_verb() {
  return {
      "refine", "re-optimises saved maps and joins several into one; or solves a .planegraph",
      "lamina refine out/monday out/tuesday --output out/both", [](CLI::App& app) {
        struct Options {
          std::vector<std::string> inputs;
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
        app.add_option("--keyframes", o->keyframes, "keyframes in the window of --mode online; 20")
            ->check(CLI::Range(3, 100000));
        app.add_flag("--quiet", o->quiet, "warnings only");
        return [o]() {
          const std::filesystem::path input = o->inputs.front();
          const bool problem = input.extension() == ".planegraph", online = o->mode == "online";
          if (online && !problem) {
            throw Error("--mode: found 'online' for " + input.string() +
                        ", expected offline: a saved map is refined as a whole");
          }
          if (o->keyframes && !online) {
            throw Error(
                "--keyframes: found the window's length without a window, expected it with a "
                ".planegraph and --mode online");
          }
          if (!problem) {
            return refine_sessions({o->inputs.begin(), o->inputs.end()}, o->output, o->quiet);
          }
          if (o->inputs.size() != 1) {
            throw Error(o->inputs[1] + ": a .planegraph is solved alone, expected one input");
          }
          constexpr int kKeyframes = 20;
          return refine_plane_graph(input, o->output, online, o->keyframes.value_or(kKeyframes));
        };
      }};
}

}  // namespace lamina::apps
