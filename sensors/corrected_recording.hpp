// A recording as it is with what is wrong with its scanner and odometry put right.
#pragma once

#include <memory>

#include <lamina/sensors/odometry_leaps.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/scan_correction.hpp>

namespace lamina {

/// The source's measurements: scans corrected, odometry without leaps (OdometryLeaps), which are a
/// warning each recording makes once, "odometry_leap".
class CorrectedRecording final : public Recording {
 public:
  /// `max_tilt` (rad): scanners that lean further are left as they are.
  CorrectedRecording(std::unique_ptr<Recording> source, const ScanCorrection& correction,
                     double max_tilt);

  std::optional<Measurement> next() override { return corrected(source_->next()); }
  std::optional<Measurement> next_light() override { return corrected(source_->next_light()); }
  std::optional<DepthFrame> next_depth(std::int64_t skip) override {
    return source_->next_depth(skip);
  }
  const Calibration& calibration() const override;
  std::map<std::string, std::int64_t> skipped() const override { return source_->skipped(); }
  std::map<std::string, std::string> first_skipped() const override {
    return source_->first_skipped();
  }
  std::map<std::string, std::vector<Timestamp>> recorded_stamps() const override {
    return source_->recorded_stamps();
  }
  std::vector<std::string> assumed() const override { return source_->assumed(); }
  std::map<Timestamp, Timestamp> restamped() const override { return source_->restamped(); }
  std::vector<std::string> remarks() const override { return source_->remarks(); }
  std::vector<Warning> warnings() const override;
  std::optional<std::int64_t> size_hint() const override { return source_->size_hint(); }
  std::optional<std::int64_t> depth_hint() const override { return source_->depth_hint(); }

 private:
  bool concerns(const SE3& T_body_lidar) const;
  std::optional<Measurement> corrected(std::optional<Measurement> measurement);

  std::unique_ptr<Recording> source_;
  ScanCorrection correction_;
  double max_tilt_;
  OdometryLeaps leaps_;
  mutable Calibration calibration_;  ///< the source's, the scanner's place corrected
};

}  // namespace lamina
