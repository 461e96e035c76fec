// `lamina info`: what a recording holds.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <optional>

#include <lamina/apps/verbs.hpp>
#include <lamina/sensors/readers/bag_contents.hpp>
#include <lamina/sensors/readers/input_kind.hpp>
#include <lamina/sensors/recording_info.hpp>

namespace lamina::apps {

Verb info_verb() {
  return {"info", "what a recording holds: streams, counts, rates, span, problems",
          "lamina info recording.log", [](CLI::App& app) {
            auto input = std::make_shared<std::string>();
            app.add_option("INPUT", *input, kInputKinds)->required();
            auto calibration = std::make_shared<std::optional<std::filesystem::path>>();
            app.add_option("--calibration", *calibration,
                           "YAML file of sensors: what it states replaces what INPUT says");
            return [input, calibration]() {
              RecordingOptions options;
              options.calibration = *calibration;
              std::cout << describe_bag(*input);
              const auto recording = open_recording(*input, options);
              std::cout << to_text(inspect(*recording));
              for (const std::string& text : recording->assumed())
                std::cout << "assumed   " << text << '\n';
              return kDone;
            };
          }};
}

}  // namespace lamina::apps
