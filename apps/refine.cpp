// `lamina refine`: solves again what is already a graph.
#include <CLI/CLI.hpp>

#include <lamina/apps/refine_plane_graph.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {

Verb refine_verb() {
  return {"refine", "re-optimises a benchmark problem (.planegraph)",
          "lamina refine rooms_2000.planegraph --output out/rooms --mode online",
          [](CLI::App& app) {
            struct Options {
              std::vector<std::string> inputs;
              std::string output, mode = "offline";
              int keyframes = 20;
            };
            auto o = std::make_shared<Options>();
            app.add_option("INPUT", o->inputs, "FILE.planegraph")->required();
            app.add_option("--output", o->output, "folder for the results")->required();
            app.add_option("--mode", o->mode, "offline: the whole graph; online: the window")
                ->check(CLI::IsMember({"offline", "online"}));
            app.add_option("--keyframes", o->keyframes, "keyframes in the window (online)")
                ->check(CLI::Range(3, 100000));
            return [o]() {
              const std::filesystem::path input = o->inputs.front();
              if (o->inputs.size() != 1 || input.extension() != ".planegraph") {
                throw Error(input.string() + ": expected one file ending in .planegraph");
              }
              return refine_plane_graph(input, o->output, o->mode == "online", o->keyframes);
            };
          }};
}

}  // namespace lamina::apps
