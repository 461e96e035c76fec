// calibration_found.yaml: what self-calibration ended with, ready to be stated next time.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Where sensors sat in the steps that were mapped.
class MountingsUsed {
 public:
  void add(const Step& step);
  /// The stated calibration with these mountings. A kind of sensor of which there are several, or
  /// whose mounting moves with the body, stays as stated.
  Calibration over(Calibration stated) const;

 private:
  struct Mounting {
    SE3 first, last;
    std::int64_t count = 0;
  };
  std::map<SensorKind, Mounting> by_kind_;
  bool several_scanners_ = false;
};

/// The text of the file: `used` with what metrics.calibration adopted; what calibration.yaml has no
/// place for stands in comments, with the setting that takes it. read_calibration() reads it.
std::string calibration_found(const Calibration& used, const Diagnostics& metrics);

}  // namespace lamina
