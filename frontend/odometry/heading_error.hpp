// Which way a scanner looks, told by the wheels: a robot on wheels moves along its own x.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/odometry/paired_motion.hpp>

namespace lamina {

/// Gathers motions of one body as wheels and as scan matching have them, and compares their
/// directions over pieces of some half a metre:
///   delta = (arg t_scan - yaw_scan / 2) - (arg t_wheels - yaw_wheels / 2).
/// A heading wrong in the scanner's mounting turns all of them by as much; wheels that drift do not
/// (half the turn is taken off), nor do wheels that err in scale.
class HeadingError {
 public:
  struct Result {
    double value = 0;  ///< rad, to be added to the stated heading to have the true one
    double sigma = 0;  ///< rad
  };

  /// The body's motion since the last call, by both; nullopt where one of them does not tell it:
  /// the piece begins anew.
  void add(const std::optional<SE3>& by_wheels, const std::optional<SE3>& by_scans);
  /// The mean over the pieces within 2.5 sigmas (by the median deviation) of the median. nullopt
  /// for fewer than 20 of them.
  std::optional<Result> result() const;

 private:
  PairedMotion piece_;  // since it began
  std::vector<double> deltas_;
};

}  // namespace lamina
