// `lamina config`: every setting with its default.
#include <CLI/CLI.hpp>
#include <iostream>

#include <lamina/apps/verbs.hpp>
#include <lamina/pipeline/config/settings.hpp>

namespace lamina::apps {

Verb config_verb() {
  return {"config", "prints every setting with its default and meaning",
          "lamina config --defaults > settings.yaml", [](CLI::App& app) {
            auto markdown = std::make_shared<bool>(false);
            auto defaults = std::make_shared<bool>(true);
            auto* yaml = app.add_flag("--defaults", *defaults,
                                      "commented YAML of all defaults: the default");
            app.add_flag("--markdown", *markdown, "the same as a table: docs/parameters.md")
                ->excludes(yaml);
            return [markdown, defaults]() {
              std::cout << (*markdown ? to_markdown(MapOptions{}) : to_yaml(MapOptions{}, true));
              return kDone;
            };
          }};
}

}  // namespace lamina::apps
