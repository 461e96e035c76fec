// The JSON of diagnostics.
#include <lamina/io/metrics.hpp>

#include <sys/resource.h>

#include <nlohmann/json.hpp>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/decimal_seconds.hpp>
#include <lamina/io/figure_names.hpp>
#include <lamina/version.hpp>

namespace lamina::io {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const StageTimes& stage) {
  return {{"calls", stage.calls()},
          {"median_ms", stage.percentile_ms(50)},
          {"p95_ms", stage.percentile_ms(95)},
          {"p99_ms", stage.percentile_ms(99)},
          {"max_ms", stage.max_ms()}};
}

Json json_of(const RefinementFigures& r) {
  std::map<std::string, double> before, after;
  for (const FactorCost& cost : r.costs) {
    before[cost.type] = cost.before;
    after[cost.type] = cost.after;
  }
  return {{"solve_s", r.solve_s},  {"iterations", r.iterations}, {"status", r.status},
          {"cost_before", before}, {"cost_after", after},        {"moved_rms_m", r.moved_rms_m}};
}

Json json_of(const LostSpan& span) {
  Json json = {{"after_s", span.after_s}, {"until_s", nullptr}};
  if (span.until_s) json["until_s"] = *span.until_s;
  return json;
}

Json json_of(const CalibrationEntry& entry) {
  return {{"parameter", entry.parameter}, {"stated", entry.stated}, {"found", entry.found},
          {"sigma", entry.sigma},         {"score", entry.score},   {"adopted", entry.adopted}};
}

double peak_resident_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

}  // namespace

void write_metrics(const std::filesystem::path& file, const Diagnostics& metrics) {
  Json json;
  json["stages"] = Json::object();
  for (const auto& [name, stage] : metrics.stages) json["stages"][name] = json_of(stage);
  if (metrics.refine) json["refine"] = json_of(*metrics.refine);
  json["peak_rss_mb"] = peak_resident_mb();
  const std::chrono::duration<double> total = std::chrono::steady_clock::now() - metrics.began;
  json["total_s"] = total.count();
  json["input"] = metrics.input;
  json["version"] = kVersion;
  json["command"] = metrics.command;
  json["tracking_lost"] = Json::array();
  for (const LostSpan& span : metrics.tracking_lost) json["tracking_lost"].push_back(json_of(span));
  json["memory"] = Json::array();
  for (const auto& sample : metrics.memory.samples()) {
    json["memory"].push_back(
        {{"time_s", decimal_seconds(sample.time_s)}, {"rss_mb", sample.rss_mb}});
  }
  json["skipped"] = Json::object();
  for (const auto& [why, count] : metrics.skipped) json["skipped"][why] = count;
  json["warnings"] = Json::array();
  for (const Warning& warning : metrics.warnings)
    json["warnings"].push_back({{"id", warning.id}, {"text", warning.text}});
  json["assumed"] = metrics.assumed;
  json["calibration"] = Json::array();
  for (const auto& entry : metrics.calibration) json["calibration"].push_back(json_of(entry));
  json["readings"] = metrics.readings;
  json["counts"] = Json::object();
  for (const auto& [what, count] : by_name(metrics.counts)) json["counts"][what] = count;
  write_atomically(file, json.dump(1) + "\n");
}

}  // namespace lamina::io
