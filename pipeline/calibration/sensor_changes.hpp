// Whether sensors stay as they are while a recording goes on.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/motion/step.hpp>
#include <lamina/frontend/motion/wheel_piece.hpp>
#include <lamina/models/step_change.hpp>
#include <lamina/models/warning.hpp>

namespace lamina {

struct SensorChangeOptions {
  double block = 2;            ///< s: errors of neighbouring images are shared for as long
  double way = 3;              ///< m of wheels beside scans in a block
  double least_tilt = 0.03;    ///< rad, and
  double least_height = 0.06;  ///< of the camera's height: smaller ones are the floor's
  double least_ratio = 0.05;   ///< of scans' way over wheels': carpets do as much
  StepChangeOptions step = {};
};

/// Follows step by step what a recording's sensors say of each other, as medians by blocks: way by
/// scans over way by wheels; the tilt and height under which the camera sees its floor. A step in
/// one of them is a camera that was knocked, a unit that changed, a scanner or wheels that became
/// others. What was estimated before it, or over both, holds for neither.
class SensorChanges {
 public:
  explicit SensorChanges(const SensorChangeOptions& options = {}) : options_(options) {}

  void add(const Step& step);
  /// Warnings "camera_changes" and "ranges_change", with when, from and to.
  std::vector<Warning> warnings() const;

 private:
  struct Series {
    std::vector<Timestamp> from;  ///< of each block's first value
    std::vector<double> medians;
    std::vector<double> block;  ///< values of the one that goes on
    void close();
  };
  void add_camera(const Step& step);
  void add_ways(const Step& step);

  SensorChangeOptions options_;
  Series roll_, pitch_, height_, ratio_;
  std::optional<Timestamp> camera_block_, way_block_;
  PairedMotion piece_;
  double way_ = 0;
};

}  // namespace lamina
