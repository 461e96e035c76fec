// `lamina view`: the report of a map.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include <lamina/apps/verbs.hpp>
#include <lamina/io/map_folder.hpp>
#include <lamina/pipeline/evaluation/evaluation.hpp>
#include <lamina/viewer/report.hpp>

namespace lamina::apps {

Verb view_verb() {
  return {"view", "writes DIR/report.html: the map to look at, in one file, no network",
          "lamina view out/room", [](CLI::App& app) {
            auto map = std::make_shared<std::string>();
            auto truth = std::make_shared<std::string>();
            app.add_option("DIR", *map, "output folder of `map`")->required();
            app.add_option("--truth", *truth,
                           "as for `evaluate`: evaluation.json is written and errors are shown");
            return [map, truth]() {
              io::require_map_folder(*map);
              if (!truth->empty()) {
                write_evaluation(std::filesystem::path(*map) / "evaluation.json",
                                 evaluate(*map, *truth));
              }
              viewer::write_report(*map);
              fmt::print("{}/report.html\n", *map);
              return kDone;
            };
          }};
}

}  // namespace lamina::apps
