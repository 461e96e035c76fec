// What a run shows on the terminal and in a browser, and how signals end it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/live.hpp>
#include <lamina/apps/progress.hpp>
#include <lamina/pipeline/run_observer.hpp>

namespace lamina::apps {

/// Log lines to stderr; warnings only when quiet.
void set_up_log(bool quiet);

/// Joins signals, progress bar and live page to one run.
class RunDisplay : public RunObserver {
 public:
  /// `live` null: no page.
  RunDisplay(InterruptGuard& interrupt, bool quiet, LivePage* live,
             std::filesystem::path output = {})
      : interrupt_(interrupt), quiet_(quiet), live_(live), output_(std::move(output)) {}

  bool should_stop() const override { return interrupt_.interrupted(); }
  double seconds_left() const override { return interrupt_.seconds_left(); }
  /// The output folder is made, if it is not there.
  void on_first_step() override;
  void on_stage(std::optional<std::int64_t> total) override;
  void on_progress(std::int64_t done, std::int64_t planes) override;
  void on_stage_end() override;
  void on_read(const Step& step, const Diagnostics& diagnostics) override;
  void on_mapped(const Step& step, const Mapper& mapper, const Diagnostics& diagnostics) override;
  void on_refining(const Mapper& mapper, const Diagnostics& diagnostics) override;
  /// Path and planes are written at once: the end may come while the grids are drawn.
  void on_path(const MapResult& result) override;

 private:
  InterruptGuard& interrupt_;
  bool quiet_;
  LivePage* live_;
  std::filesystem::path output_;
  bool made_ = false;  // the output folder
  std::optional<std::int64_t> total_;
  std::optional<Progress> progress_;
};

}  // namespace lamina::apps
