// metrics.json: how long each stage took, and what was skipped.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/models/warning.hpp>

namespace lamina::io {

/// Times of one stage. Up to kExact times are kept as they are; from then on all are counted in
/// steps of 1 %, so that memory stays flat over any run and percentiles are within half of that.
class StageTimes {
 public:
  void add(double ms);
  std::int64_t calls() const { return calls_; }
  double max_ms() const { return max_; }
  /// Nearest-rank percentile in [0, 100]; 0 when nothing was added.
  double percentile_ms(double percent) const;

 private:
  static constexpr std::size_t kExact = 4096;
  void count(double ms);
  std::vector<double> exact_;         // all, while they are few
  std::vector<std::int64_t> counts_;  // by step, once they are many
  std::int64_t calls_ = 0;
  double max_ = 0;
};

struct RefineMetrics {
  double solve_s = 0;
  int iterations = 0;
  std::string status;
  std::map<std::string, double> cost_before, cost_after;  ///< chi-squared by factor type
  double moved_rms_m = 0;                                 ///< how far poses moved, rms
};

/// Resident memory of the process now, MB.
double resident_mb();

/// Memory over a run. Beyond kKept samples every second is dropped and the interval doubles.
class MemoryTrace {
 public:
  struct Sample {
    double time_s, rss_mb;  ///< of the recording, since its first measurement
  };
  /// Takes a sample when the interval has passed.
  void note(double recording_s);
  const std::vector<Sample>& samples() const { return samples_; }

 private:
  static constexpr std::size_t kKept = 720;
  std::vector<Sample> samples_;
  std::optional<double> first_;
  double interval_s_ = 10;
};

/// When tracking was lost: after the last instant that was tracked, until the next one that was.
struct LostSpan {
  double after_s = 0;             ///< stamps of the recording, s
  std::optional<double> until_s;  ///< none: not to the end
};

/// A parameter that self-calibration asked about: what was stated, what the recording shows.
struct CalibrationEntry {
  std::string parameter;  ///< with its unit, as calibration.yaml or the setting calls it
  double stated = 0, found = 0, sigma = 0;
  double score = 0;  ///< gain of the evidence that did not suggest it; see docs/robustness.md
  bool adopted = false;
};

struct Metrics {
  std::map<std::string, StageTimes> stages;
  std::optional<RefineMetrics> refine;
  std::map<std::string, std::int64_t> skipped;
  MemoryTrace memory;
  std::vector<LostSpan> tracking_lost;  ///< the first kMostSpans of them
  static constexpr std::size_t kMostSpans = 1000;
  std::map<std::string, double> counts;  ///< frames, keyframes, planes, loops, ...
  std::vector<Warning> warnings;         ///< in the order found; one a cause
  std::vector<std::string> assumed;      ///< what no file or topic stated
  std::vector<CalibrationEntry> calibration;
  std::int64_t readings = 0;  ///< how often the recording was read

  /// Records a warning; the first of a cause stands.
  void warn(std::string id, std::string text);

  /// Times a scope: { const auto timer = metrics.time("floor"); ... }.
  class Timer {
   public:
    Timer(StageTimes& stage) : stage_(stage) {}
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
    ~Timer() {
      stage_.add(std::chrono::duration<double, std::milli>(Clock::now() - start_).count());
    }

   private:
    using Clock = std::chrono::steady_clock;
    StageTimes& stage_;
    Clock::time_point start_ = Clock::now();
  };
  Timer time(const std::string& stage) { return Timer(stages[stage]); }
};

/// docs/formats.md; peak memory is read from the running process.
void write_metrics(const std::filesystem::path& file, const Metrics& metrics);

}  // namespace lamina::io
