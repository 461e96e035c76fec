// What self-calibration asked of the sensors, told alike for all of them.
#pragma once

#include <string>

#include <lamina/models/adoption.hpp>
#include <lamina/models/diagnostics.hpp>

namespace lamina {

/// A parameter as it was stated and as a recording has it.
struct Estimate {
  std::string parameter;  ///< as calibration.yaml or the setting calls it, with its unit
  double stated = 0, found = 0, sigma = 0;
  Adoption adoption;
  /// How far the truth may lie from what is stated, 0: anywhere. Beyond, the data contradict each
  /// other, and correcting this parameter alone would hide why.
  double bound = 0;
};

/// Puts the parameter among those of metrics.json, and a line into the log: before and after where
/// it is adopted, else why not. Beyond its bound it is a warning of this id and consequence. True
/// where it is adopted.
bool report(const Estimate& estimate, Diagnostics& metrics, const std::string& warning_id = {},
            const std::string& consequence = {});

/// What was adopted: before and after. `score` is 0 where no blocks were left out.
void report_change(const std::string& parameter, double stated, double found, double sigma,
                   Diagnostics& metrics, double score = 0);

}  // namespace lamina
