// One line a parameter.
#include <lamina/pipeline/calibration/calibration_report.hpp>
#include <lamina/pipeline/calibration/log.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>

namespace lamina {
namespace {

// A value clearly beyond its bound is said even where blocks are too few to adopt one.
bool contradicts(const Estimate& e) {
  constexpr double kGain = 9, kSigmas = 3;
  return e.bound > 0 && e.adoption.gain > kGain &&
         std::abs(e.found - e.stated) > e.bound + kSigmas * e.sigma;
}

// The entry of this parameter: what is asked again, or corrected further, is told once.
CalibrationEntry& entry_of(const std::string& parameter, double stated, Diagnostics& metrics) {
  for (CalibrationEntry& entry : metrics.calibration) {
    if (entry.parameter == parameter) return entry;
  }
  return metrics.calibration.emplace_back(CalibrationEntry{parameter, stated});
}

}  // namespace

bool report(const Estimate& e, Diagnostics& metrics, const std::string& warning_id,
            const std::string& consequence) {
  const bool beyond = e.bound > 0 && std::abs(e.found - e.stated) > e.bound;
  const bool adopted = e.adoption.adopted && !beyond;
  CalibrationEntry& entry = entry_of(e.parameter, e.stated, metrics);
  entry.found = e.found;
  entry.sigma = e.sigma;
  entry.score = e.adoption.gain;
  entry.adopted = adopted;
  const std::string value =
      fmt::format("{} {:.6g} -> {:.6g} (+-{:.2g})", e.parameter, e.stated, e.found, e.sigma);
  if (adopted) {
    run_log().info("corrected: {}, gain {:.0f} over {} blocks left out", value, e.adoption.gain,
                   e.adoption.blocks);
  } else if (e.adoption.adopted || contradicts(e)) {
    metrics.warn(warning_id, fmt::format("{}: such a value is off by {:.3g} at most, something "
                                         "else is wrong; {}",
                                         value, e.bound, consequence));
  } else {
    run_log().info(
        "kept as stated: {} does not fit better what was left out (gain {:.1f} over {} "
        "blocks)",
        value, e.adoption.gain, e.adoption.blocks);
  }
  return adopted;
}

void report_change(const std::string& parameter, double stated, double found, double sigma,
                   Diagnostics& metrics, double score) {
  CalibrationEntry& entry = entry_of(parameter, stated, metrics);
  entry.found = found;
  entry.sigma = sigma;
  entry.score = score;
  entry.adopted = true;
  run_log().info("corrected: {} {:.6g} -> {:.6g} (+-{:.2g})", parameter, stated, found, sigma);
}

}  // namespace lamina
