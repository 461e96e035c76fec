// `lamina info`: what a recording holds.
#include <CLI/CLI.hpp>
#include <iostream>

#include <lamina/apps/verbs.hpp>
#include <lamina/sensors/recording_info.hpp>

namespace lamina::apps {

Verb info_verb() {
  return {"info", "what a recording holds: streams, counts, rates, span, problems",
          "lamina info recording.log", [](CLI::App& app) {
            auto input = std::make_shared<std::string>();
            app.add_option("INPUT", *input,
                           "dataset folder, .oni, .log, .clf, .rawlog, .bag, .pcd, or openni:[URI]")
                ->required();
            return [input]() {
              const auto recording = open_recording(*input);
              std::cout << to_text(inspect(*recording));
              return kDone;
            };
          }};
}

}  // namespace lamina::apps
