// Percentiles of stages, samples of memory, warnings once a cause.
#include <lamina/models/diagnostics.hpp>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace lamina {
namespace {

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

SensorFigures& Figures::of(std::string_view sensor) {
  if (sensor == "scanner") return scanner;
  if (sensor == "camera") return camera;
  if (sensor == "odometry") return odometry;
  throw std::out_of_range("no sensor " + std::string(sensor));
}

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

void Diagnostics::warn(std::string id, std::string text) {
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

}  // namespace lamina
