// `lamina export`: a map in forms that other programs read.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <lamina/apps/verbs.hpp>
#include <lamina/pipeline/export_map.hpp>

namespace lamina::apps {

Verb export_verb() {
  return {"export", "a map in forms that other programs read",
          "lamina export out/room --to keepout", [](CLI::App& app) {
            auto map = std::make_shared<std::string>();
            auto format = std::make_shared<std::string>();
            auto output = std::make_shared<std::string>();
            std::string forms;
            for (const ExportFormat& f : export_formats()) forms += f.name + ": " + f.summary;
            app.add_option("DIR", *map, "output folder of `map`")->required();
            app.add_option("--to", *format, forms)->required();
            app.add_option("--output", *output, "folder to write into; DIR where not given");
            return [map, format, output]() {
              for (const auto& file : export_map(*map, *format, output->empty() ? *map : *output))
                fmt::print("{}\n", file.string());
              return kDone;
            };
          }};
}

}  // namespace lamina::apps
