// `lamina refine`: solves again what is already a graph.
#include <CLI/CLI.hpp>

#include <lamina/apps/refine_plane_graph.hpp>
#include <lamina/apps/refine_session.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {

Verb refine_verb() {
  return {"refine", "re-optimises saved maps and joins several into one; or solves a .planegraph",
          "lamina refine out/monday out/tuesday --output out/both", [](CLI::App& app) {
            struct Options {
              std::vector<std::string> inputs;
              std::string output, mode = "offline";
              int keyframes = 20;
              bool quiet = false;
            };
            auto o = std::make_shared<Options>();
            app.add_option("INPUT", o->inputs,
                           "output folders of `map` (several are joined), or FILE.planegraph")
                ->required();
            app.add_option("--output", o->output, "folder for the results")->required();
            app.add_option("--mode", o->mode, "offline: the whole graph; online: the window")
                ->check(CLI::IsMember({"offline", "online"}));
            app.add_option("--keyframes", o->keyframes, "keyframes in the window (online)")
                ->check(CLI::Range(3, 100000));
            app.add_flag("--quiet", o->quiet, "warnings only");
            return [o]() {
              const std::filesystem::path input = o->inputs.front();
              if (input.extension() != ".planegraph") {
                return refine_sessions({o->inputs.begin(), o->inputs.end()}, o->output, o->quiet);
              }
              if (o->inputs.size() != 1) {
                throw Error(o->inputs[1] + ": a .planegraph is solved alone, expected one input");
              }
              return refine_plane_graph(input, o->output, o->mode == "online", o->keyframes);
            };
          }};
}

}  // namespace lamina::apps
