// Warnings of readers, front-end and result, in one list.
#include <lamina/pipeline/run_warnings.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>

#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/calibration/scanner_calibration.hpp>
#include <lamina/pipeline/diagnostics.hpp>

namespace lamina {
namespace {

// Left out by choice, or because nothing is mapped with it: no loss.
bool is_meant(const std::string& why) {
  constexpr const char* kStarts[] = {"topic not used", "kind not used",     "kind of line not read",
                                     "second record",  "laser whose place", "stream not used",
                                     "scan: "};
  return std::any_of(std::begin(kStarts), std::end(kStarts),
                     [&why](const char* start) { return why.starts_with(start); });
}

// Frames and lines that were left out are more than an accident from a hundredth on.
std::vector<Warning> dropped_frames(const Recording& recording, const Diagnostics& metrics) {
  constexpr double kShare = 0.01;
  std::int64_t dropped = 0;
  std::string reasons;
  const auto firsts = recording.first_skipped();
  for (const auto& [why, count] : metrics.skipped) {
    if (is_meant(why)) continue;
    dropped += count;
    reasons += fmt::format("{}{} x {}", reasons.empty() ? "" : ", ", count, why);
    if (const auto first = firsts.find(why); first != firsts.end())
      reasons += ", first " + first->second;
  }
  const double kept = metrics.counts.steps;
  if (!(static_cast<double>(dropped) > kShare * (kept + static_cast<double>(dropped)))) return {};
  return {
      {"frames_dropped",
       fmt::format("{} lines or frames were left out beside {:.0f} that were mapped ({}): the map "
                   "lacks what they saw",
                   dropped, kept, reasons)}};
}

// Sound up to where it is cut: the map is right as far as it goes.
std::vector<Warning> cut_short(const Diagnostics& metrics) {
  if (metrics.skipped.count("damaged end of file") == 0) return {};
  return {{"input_cut_short",
           "the recording ends in damaged or missing data (cut short while it was written, copied "
           "or compressed?): what comes before is mapped, the rest is not"}};
}

}  // namespace

void note_assumed(const Recording& recording, Diagnostics& metrics) {
  metrics.assumed = recording.assumed();
  if (metrics.assumed.empty()) return;
  run_log().info("assumed, as nothing states it: {} (--calibration FILE states it)",
                 fmt::join(metrics.assumed, "; "));
}

void warn_of_end(const Recording& recording, bool resumable, RunRecord& record) {
  Diagnostics& metrics = record.diagnostics;
  const double read = metrics.counts.measurements;
  const std::string all =
      recording.size_hint() ? fmt::format(" of {}", *recording.size_hint()) : std::string();
  const std::string unmapped =
      record.unmapped.empty()
          ? std::string()
          : fmt::format(
                ". There was time to map what comes before {} s: planes and grids end there, "
                "the last {} poses of the path are dead reckoning",
                record.unmapped.front().first.to_string(), record.unmapped.size());
  const char* resume =
      resumable ? "; the same command with --resume goes on from the checkpoint" : "";
  metrics.warn("interrupted",
               fmt::format("interrupted: the map is partial ({:.0f}{} measurements were read){}{}",
                           read, all, unmapped, resume));
}

void warn_of_result(const std::string& input, const Recording& recording, const FrontEnd& front_end,
                    Diagnostics& metrics) {
  const auto warn = [&metrics](std::vector<Warning> found) {
    for (Warning& one : found) metrics.warn(std::move(one.id), std::move(one.text));
  };
  warn(recording.warnings());
  warn(dropped_frames(recording, metrics));
  warn(cut_short(metrics));
  warn(result_warnings(input, front_end, metrics));
}

void warn_of_scanner(Recording& again, const CalibrationOptions& options,
                     const std::function<bool()>& ended, Diagnostics& metrics) {
  if (const auto found = check_scanner(again, options, ended))
    report_scanner(*found, again.calibration(), false, metrics);
}

}  // namespace lamina
