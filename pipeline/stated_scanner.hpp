// What the user's settings state of a scanner, in place of what its recording says.
#pragma once

#include <cmath>
#include <memory>
#include <utility>

#include <lamina/sensors/forwarding_recording.hpp>

namespace lamina {

/// Zeros: as the recording says.
struct StatedScanner {
  double range_sigma = 0;    ///< m, 1-sigma of a range
  double field_of_view = 0;  ///< rad, from a scan's first beam to its last
  bool any() const { return range_sigma > 0 || field_of_view > 0; }

  void apply(LaserScan& scan) const {
    if (range_sigma > 0) scan.lidar.noise.range_sigma = range_sigma;
    if (field_of_view > 0 && scan.size() > 1) {
      const double intervals = static_cast<double>(scan.size() - 1);
      const double middle = scan.angle_min + 0.5 * intervals * scan.angle_increment;
      scan.angle_increment = std::copysign(field_of_view / intervals, scan.angle_increment);
      scan.angle_min = middle - 0.5 * intervals * scan.angle_increment;
    }
  }
};

/// The source's measurements, its scans as stated: beams stay about the middle of the fan.
class StatedScannerRecording final : public ForwardingRecording {
 public:
  StatedScannerRecording(std::unique_ptr<Recording> source, const StatedScanner& stated)
      : ForwardingRecording(std::move(source)), stated_(stated) {}

  std::optional<Measurement> next() override { return as_stated(source().next()); }
  std::optional<Measurement> next_light() override { return as_stated(source().next_light()); }
  const Calibration& calibration() const override {
    calibration_ = source().calibration();
    if (calibration_.lidar && stated_.range_sigma > 0)
      calibration_.lidar->noise.range_sigma = stated_.range_sigma;
    return calibration_;
  }

 private:
  std::optional<Measurement> as_stated(std::optional<Measurement> measurement) const {
    if (auto* scan = measurement ? std::get_if<LaserScan>(&*measurement) : nullptr)
      stated_.apply(*scan);
    return measurement;
  }

  StatedScanner stated_;
  mutable Calibration calibration_;  ///< the source's, as stated
};

}  // namespace lamina
