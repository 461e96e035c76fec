// What a run says of itself: figures, warnings, stage times, memory; typed, texts only for people.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lamina/models/skipped.hpp>
#include <lamina/models/warning.hpp>

namespace lamina {

/// A figure of a run. One that was never set is not known: it counts as 0, and is not written.
class Figure {
 public:
  Figure() = default;
  Figure(double value) : value_(value), known_(true) {}
  operator double() const { return value_; }
  bool known() const { return known_; }
  Figure& operator+=(double more) { return *this = value_ + more; }
  Figure& operator++() { return *this += 1; }

 private:
  double value_ = 0;
  bool known_ = false;
};

/// What was corrected of one sensor.
struct SensorFigures {
  Figure clock_ms;
  std::array<Figure, 3> turned_deg, moved_cm;  ///< about and along x, y, z of the body
};

/// Figures of a run by their names in metrics.json, where their units and meanings stand
/// (docs/formats.md).
struct Figures {
  // of the run
  Figure measurements, steps, keyframes, checkpoints, path_m, planes, loops, scan_loops,
      joined_planes, leaning_walls, rejected_factors, rank_deficiency;
  // of tracking
  Figure steps_with_unknown_motion, steps_with_tracking_lost, tracking_lost_after_s,
      steps_with_open_direction, open_direction_longest_m, scans_with_open_direction,
      scans_open_direction_longest_m, scans_left_out, ground_returns, slopes_by_images,
      motions_by_images;
  // of stretches that wheels alone measured
  Figure by_wheels_alone_m, by_wheels_alone_sigma_m, way_by_wheels_alone_m,
      heading_by_wheels_alone_m, way_by_wheels_alone_longest_m, way_by_wheels_alone_longest_from_s,
      way_by_wheels_alone_longest_to_s, wheels_slipped_m;
  // of sensors
  Figure depth_noise_over_calibration, scanner_noise_cm, scanner_sweep_ms, start_tilt_deg,
      camera_start_roll_deg, camera_start_pitch_deg, camera_start_height_m, depth_bend_rms_px,
      depth_bend_max_px, depth_focal_px, mounting_heading_sigma_deg, mounting_place_sigma_cm,
      wheel_scale_correction, wheel_drift_correction_deg_per_m, wheel_turn_correction;
  // of the grid
  Figure cells_free, cells_step_open, images_show_no_floor;
  std::array<Figure, 2> depth_slope_px;  // across, down
  SensorFigures scanner, camera, odometry;

  /// By its name in metrics.json. Throws std::out_of_range for another.
  SensorFigures& of(std::string_view sensor);
};

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

/// Chi-squared of all factors of one type, before and after a refinement.
struct FactorCost {
  std::string type;
  double before = 0, after = 0;
};

struct RefinementFigures {
  double solve_s = 0;
  int iterations = 0;
  std::string status;
  std::vector<FactorCost> costs;  ///< of the types that occur
  double moved_rms_m = 0;         ///< how far poses moved, rms
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

/// What a run found out about itself, its input and its result: written as metrics.json.
struct Diagnostics {
  std::string input;    ///< the recording, as it was named
  std::string command;  ///< what the program was called with; empty: a library call
  std::chrono::steady_clock::time_point began = std::chrono::steady_clock::now();
  std::map<std::string, StageTimes> stages;
  std::optional<RefinementFigures> refine;
  SkippedCounts skipped;
  MemoryTrace memory;
  std::vector<LostSpan> tracking_lost;  ///< the first kMostSpans of them
  static constexpr std::size_t kMostSpans = 1000;
  Figures counts;                    ///< frames, keyframes, planes, loops, ...
  std::vector<Warning> warnings;     ///< in the order found; one a cause
  std::vector<std::string> assumed;  ///< what no file or topic stated
  std::vector<CalibrationEntry> calibration;
  std::int64_t readings = 0;  ///< how often the recording was read

  /// Records a warning; the first of a cause stands.
  void warn(std::string id, std::string text);

  /// Times a scope: { const auto timer = diagnostics.time("floor"); ... }.
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

}  // namespace lamina
