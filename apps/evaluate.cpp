// `lamina evaluate`: a map's accuracy against a reference.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include <lamina/apps/verbs.hpp>
#include <lamina/io/map_folder.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/evaluation/evaluation.hpp>

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

EvaluationOptions options_of(const std::string& align, bool by_index, const std::string& truth,
                             const std::string& relations) {
  if (truth.empty() && relations.empty()) {
    throw Error(
        "--truth DATASET or --relations FILE is missing; e.g. lamina evaluate DIR --truth "
        "DATASET");
  }
  const Alignment alignment = align == "none"  ? Alignment::kNone
                              : align == "yaw" ? Alignment::kYaw
                                               : Alignment::kSe3;
  return {alignment, by_index, relations, {}};
}

}  // namespace

Verb evaluate_verb() {
  return {"evaluate", "accuracy of a map against a reference; writes evaluation.json",
          "lamina evaluate out/room --truth data/room --max-ate 0.02", [](CLI::App& app) {
            struct Options {
              std::string map, truth, relations, align = "se3";
              bool by_index = false;
              MarkerFitOptions marker;
              EvaluationLimits limits;
            };
            auto o = std::make_shared<Options>();
            app.add_option("DIR", o->map, "output folder of `map` or `refine`")->required();
            app.add_option("--truth", o->truth,
                           "dataset folder with groundtruth.txt (and truth.yaml), or a TUM file");
            app.add_option("--relations", o->relations,
                           "hand-checked relative poses, lines `t1 t2 x y z roll pitch yaw`");
            app.add_option("--align", o->align,
                           "what may lay the path on the reference: none, yaw (and an offset) or "
                           "se3; a mirrored path passes by se3 alone")
                ->check(CLI::IsMember({"none", "yaw", "se3"}));
            app.add_flag("--by-index", o->by_index,
                         "compare pose by pose in order, whatever the reference's stamps");
            app.add_flag("--fit-lever", o->marker.lever,
                         "the reference is of a marker: fit its place");
            app.add_flag("--fit-clock", o->marker.clock, "fit what its clock shows more");
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
              io::require_map_folder(o->map);
              auto options = options_of(o->align, o->by_index, o->truth, o->relations);
              options.marker = o->marker;
              const Evaluation evaluation = evaluate(o->map, o->truth, options);
              std::cout << to_text(evaluation);
              write_evaluation(std::filesystem::path(o->map) / "evaluation.json", evaluation);
              const auto failures = exceeded(evaluation, o->limits);
              for (const auto& failure : failures) std::cerr << "lamina: " << failure << '\n';
              return failures.empty() ? kDone : kFailed;
            };
          }};
}

}  // namespace lamina::apps
