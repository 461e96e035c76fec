// `lamina evaluate`: a map's accuracy against a reference.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include <lamina/apps/evaluation.hpp>
#include <lamina/apps/map_folder.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {

namespace {

// A limit that nothing or everything keeps decides nothing.
void require_limits(const EvaluationLimits& limits) {
  const auto require = [](const char* name, const std::optional<double>& limit) {
    if (!limit || *limit >= 0) return;
    throw Error(
        fmt::format("{}: found '{}', expected a number that is not negative", name, *limit));
  };
  require("--max-ate", limits.max_ate_m);
  require("--max-rpe", limits.max_rpe_m);
  require("--max-plane-rho", limits.max_plane_rho_m);
  require("--max-plane-angle-deg", limits.max_plane_angle_deg);
  require("--max-missed", limits.max_missed);
  require("--max-false-free", limits.max_false_free);
}

}  // namespace

Verb evaluate_verb() {
  return {"evaluate", "accuracy of a map against a reference; writes evaluation.json",
          "lamina evaluate out/room --truth data/room --max-ate 0.02", [](CLI::App& app) {
            struct Options {
              std::string map, truth;
              EvaluationLimits limits;
            };
            auto o = std::make_shared<Options>();
            app.add_option("DIR", o->map, "output folder of `map` or `refine`")->required();
            app.add_option("--truth", o->truth,
                           "dataset folder with groundtruth.txt (and truth.yaml), or a TUM file")
                ->required();
            app.add_option("--max-ate", o->limits.max_ate_m,
                           "fail (exit 1) when the aligned ATE rmse is above this, m");
            app.add_option("--max-rpe", o->limits.max_rpe_m,
                           "fail when the RPE rmse over one second is above this, m");
            app.add_option("--max-plane-rho", o->limits.max_plane_rho_m,
                           "fail when the mean error of plane distances is above this, m");
            app.add_option("--max-plane-angle-deg", o->limits.max_plane_angle_deg,
                           "fail when the mean angle error of planes is above this, degrees");
            app.add_option("--max-missed", o->limits.max_missed,
                           "fail when more true planes than this are missed");
            app.add_option("--max-false-free", o->limits.max_false_free,
                           "fail when more than this share of free cells is not free, 0 to 1");
            return [o]() {
              require_limits(o->limits);
              require_map_folder(o->map);
              const Evaluation evaluation = evaluate(o->map, o->truth);
              std::cout << to_text(evaluation);
              write_evaluation(std::filesystem::path(o->map) / "evaluation.json", evaluation);
              const auto failures = exceeded(evaluation, o->limits);
              for (const auto& failure : failures) std::cerr << "lamina: " << failure << '\n';
              return failures.empty() ? kDone : kFailed;
            };
          }};
}

}  // namespace lamina::apps
