// A run's progress on disk: what a killed run goes on from.
//
// Two files in OUTPUT/.checkpoint. `journal` grows: every step as the front-ends made it, and the
// loops found with it. `state` is replaced whole: how many measurements went in, how much of the
// journal that is, and all that the front-ends and the loop closer carry from one measurement to
// the next. What comes behind them, mapper and refiner, is a function of the steps alone.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/pipeline/closed_step.hpp>

namespace lamina {

class Checkpoint {
 public:
  /// `identity`: input, mode and settings; a checkpoint of another run is refused.
  Checkpoint(const std::filesystem::path& output, std::string identity, double interval_s);
  ~Checkpoint();
  Checkpoint(const Checkpoint&) = delete;
  Checkpoint& operator=(const Checkpoint&) = delete;

  /// Throws lamina::Error where there is a checkpoint of another run.
  void require_same_run() const;
  /// Reads a checkpoint, if there is one, into front-end and closer and gives the journal's entries
  /// in order. Returns how many measurements it holds; 0: none there, begin at the beginning.
  /// Throws lamina::Error when it is of another run, or damaged.
  std::int64_t resume(FrontEnd& front_end, LoopCloser& closer,
                      const std::function<void(ClosedStep&&)>& take);
  /// Forgets what an earlier run left.
  void begin();
  /// A step of the journal; on disk at the next save().
  void add(const Step& step, const std::vector<LoopClosure>& loops);
  /// After each measurement.
  void measured() { ++measurements_; }
  /// The interval has passed since the last save.
  bool due() const;
  /// What both are after all that was measured; the steps that came of it are all added.
  void save(const FrontEnd& front_end, const LoopCloser& closer);
  /// The results are written: nothing to go on from. `output`: as given to the constructor.
  static void remove(const std::filesystem::path& output);
  /// Times a checkpoint was written.
  std::int64_t saves() const { return saves_; }

 private:
  using Clock = std::chrono::steady_clock;
  void append_journal();

  std::filesystem::path folder_;
  std::string identity_;
  double interval_s_;
  std::string pending_;  // entries that are not in the journal yet
  std::int64_t measurements_ = 0, saves_ = 0;
  std::uint64_t journal_bytes_ = 0, journal_sum_ = 0;
  int journal_ = -1;  // file descriptor
  Clock::time_point last_ = Clock::now();
};

}  // namespace lamina
