// A recording as it is with what is wrong with its scanner and odometry put right.
#pragma once

#include <memory>

#include <lamina/sensors/forwarding_recording.hpp>
#include <lamina/sensors/odometry_leaps.hpp>
#include <lamina/sensors/odometry_units.hpp>
#include <lamina/sensors/scan_correction.hpp>

namespace lamina {

/// The source's measurements: scans corrected, odometry in metres and radians and without leaps
/// (OdometryLeaps), which are a warning each recording makes once, "odometry_leap".
class CorrectedRecording final : public ForwardingRecording {
 public:
  /// `max_tilt` (rad): scanners that lean further are left as they are.
  CorrectedRecording(std::unique_ptr<Recording> source, const ScanCorrection& correction,
                     double max_tilt, const OdometryUnits& units = {});

  std::optional<Measurement> next() override { return corrected(source().next()); }
  std::optional<Measurement> next_light() override { return corrected(source().next_light()); }
  const Calibration& calibration() const override;
  std::vector<Warning> warnings() const override;

 private:
  bool concerns(const SE3& T_body_lidar) const;
  std::optional<Measurement> corrected(std::optional<Measurement> measurement);

  ScanCorrection correction_;
  double max_tilt_;
  OdometryInMetres in_metres_;
  OdometryLeaps leaps_;
  mutable Calibration calibration_;  ///< the source's, the scanner's place corrected
};

}  // namespace lamina
