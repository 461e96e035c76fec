// Percentiles and the JSON of them.
#include <lamina/io/metrics.hpp>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/decimal_seconds.hpp>

namespace lamina::io {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kShortest = 1e-4, kStep = 0.01;  // ms; share of a time

std::size_t step_of(double ms) {
  return ms > kShortest ? 1 + static_cast<std::size_t>(std::log(ms / kShortest) / std::log1p(kStep))
                        : 0;
}

// The middle of a step.
double time_of(std::size_t step) {
  return step == 0 ? 0 : kShortest * std::pow(1 + kStep, static_cast<double>(step) - 0.5);
}

}  // namespace

void StageTimes::add(double ms) {
  max_ = std::max(max_, ms);
  ++calls_;
  if (!counts_.empty()) return count(ms);
  exact_.push_back(ms);
  if (exact_.size() < kExact) return;
  for (const double time : exact_) count(time);
  exact_ = {};
}

void StageTimes::count(double ms) {
  constexpr double kLongest = 1e9;  // ms
  const std::size_t step = step_of(std::min(ms, kLongest));
  if (step >= counts_.size()) counts_.resize(step + 1);
  ++counts_[step];
}

double StageTimes::percentile_ms(double percent) const {
  if (calls_ == 0) return 0;
  const double rank = std::max(1.0, std::ceil(percent / 100.0 * static_cast<double>(calls_)));
  if (!counts_.empty()) {
    double below = 0;
    for (std::size_t step = 0; step < counts_.size(); ++step) {
      below += static_cast<double>(counts_[step]);
      if (below >= rank) return std::min(time_of(step), max_);
    }
    return max_;
  }
  std::vector<double> sorted = exact_;
  const auto index = static_cast<std::ptrdiff_t>(rank) - 1;
  std::nth_element(sorted.begin(), sorted.begin() + index, sorted.end());
  return sorted[static_cast<std::size_t>(index)];
}

void Metrics::warn(std::string id, std::string text) {
  const auto same = [&id](const Warning& other) { return other.id == id; };
  if (std::none_of(warnings.begin(), warnings.end(), same))
    warnings.push_back({std::move(id), std::move(text)});
}

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double pages_in_all = 0, pages = 0;
  statm >> pages_in_all >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

void MemoryTrace::note(double recording_s) {
  if (!first_) first_ = recording_s;
  const double time = recording_s - *first_;
  if (!samples_.empty() && time < samples_.back().time_s + interval_s_) return;
  samples_.push_back({time, resident_mb()});
  if (samples_.size() < kKept) return;
  for (std::size_t i = 0; 2 * i < samples_.size(); ++i) samples_[i] = samples_[2 * i];
  samples_.resize(samples_.size() / 2);
  interval_s_ *= 2;
}

namespace {

Json json_of(const StageTimes& stage) {
  return {{"calls", stage.calls()},
          {"median_ms", stage.percentile_ms(50)},
          {"p95_ms", stage.percentile_ms(95)},
          {"p99_ms", stage.percentile_ms(99)},
          {"max_ms", stage.max_ms()}};
}

Json json_of(const RefineMetrics& r) {
  return {{"solve_s", r.solve_s},       {"iterations", r.iterations},
          {"status", r.status},         {"cost_before", r.cost_before},
          {"cost_after", r.cost_after}, {"moved_rms_m", r.moved_rms_m}};
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

void write_metrics(const std::filesystem::path& file, const Metrics& metrics) {
  Json json;
  json["stages"] = Json::object();
  for (const auto& [name, stage] : metrics.stages) json["stages"][name] = json_of(stage);
  if (metrics.refine) json["refine"] = json_of(*metrics.refine);
  json["peak_rss_mb"] = peak_resident_mb();
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
  for (const auto& [what, count] : metrics.counts) json["counts"][what] = count;
  write_atomically(file, json.dump(1) + "\n");
}

}  // namespace lamina::io
