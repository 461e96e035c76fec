// A run's reports handed on to terminal and page.
#include <lamina/apps/run_display.hpp>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <lamina/io/atomic_file.hpp>
#include <lamina/pipeline/write_results.hpp>

namespace lamina::apps {

void set_up_log(bool quiet) {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "lamina", std::make_shared<spdlog::sinks::stderr_color_sink_mt>()));
  spdlog::set_pattern("%^%l%$: %v");
  spdlog::set_level(quiet ? spdlog::level::warn : spdlog::level::info);
}

void RunDisplay::on_first_step() {
  interrupt_.something_stands();
  if (made_ || output_.empty()) return;
  made_ = true;
  io::make_results_folder(output_);
}

void RunDisplay::on_stage(std::optional<std::int64_t> total) {
  total_ = total;
  progress_.emplace(total, quiet_);
}

void RunDisplay::on_progress(std::int64_t done, std::int64_t planes) {
  if (progress_) progress_->update(done, planes);
  if (live_) live_->progress(done, total_);
}

void RunDisplay::on_stage_end() {
  if (progress_) progress_->finish();
  progress_.reset();
}

void RunDisplay::on_read(const Step& step, const Diagnostics& diagnostics) {
  if (live_) live_->read(step, diagnostics);
}

void RunDisplay::on_mapped(const Step& step, const Mapper& mapper, const Diagnostics& diagnostics) {
  if (live_) live_->mapped(step, mapper, diagnostics);
}

void RunDisplay::on_refining(const Mapper& mapper, const Diagnostics& diagnostics) {
  if (live_) live_->refining(mapper, diagnostics);
}

void RunDisplay::on_path(const MapResult& result) {
  if (!output_.empty()) write_path(output_, result);
}

}  // namespace lamina::apps
