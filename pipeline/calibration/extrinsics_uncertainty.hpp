// What calibration leaves unknown of where sensors sit on the body, and of wheels.
#pragma once

#include <Eigen/Core>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/pipeline/calibration/mounting_evidence.hpp>

namespace lamina {

/// Error of the mounting across the floor as steps have it at last: how well it is stated, and what
/// wheels told of it. A sensor is turned about its own place by a wrong heading. One said to sit in
/// the very middle (to 1 mm) is one of which nobody said where it sits: its place is certain,
/// and without wheels its heading, poses being its own.
class ExtrinsicsUncertainty {
 public:
  explicit ExtrinsicsUncertainty(const CalibrationOptions& settings);
  /// A step's sensor as it is stated, before corrections: the last level scanner counts, else the
  /// last sensor.
  void met(const Step& step, bool wheels);
  /// Adds what is told of mountings as they are since.
  void update(const MountingEvidence& evidence);
  /// E[e e^T] of e as by_mounting() has it: what evidence says is left and was not corrected (it
  /// did not stand out from chance) counts as an error.
  Eigen::Matrix3d covariance() const;
  /// Whether nothing but wheels told the path: beside them only scanners that are not level. Such
  /// a fan across the way never sees the same twice but where the robot comes by again, and its
  /// walls follow the path.
  bool wheels_alone() const { return wheels_ && fans_ && !others_; }
  /// covariance() to the mapper, in the log and among the counts. Where wheels told the path alone
  /// they are taken to err as is usual (WheelPrior: 3 %, 1.1 deg/m, 1 % of turns), and how far the
  /// path may be off by that and by their noise is told like WheelPath's.
  void tell(Mapper& mapper, Diagnostics& metrics) const;

 private:
  double sigma_heading_, sigma_place_;  // 1-sigma of what is stated, rad and m
  Eigen::Vector2d place_body_ = Eigen::Vector2d::Zero();
  bool level_scanner_ = false, wheels_ = false;
  bool fans_ = false, others_ = false;  // scanners that are not level; what tells motions itself
  MountingEvidence evidence_;
};

}  // namespace lamina
