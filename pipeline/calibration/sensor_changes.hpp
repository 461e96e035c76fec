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
  double moved = 0.05;         ///< m or rad from one image that counts to the next
  double level = 0.25;         ///< rad: planes tilted by less may be floor
  double least_tilt = 0.03;    ///< rad, and
  double least_height = 0.06;  ///< of the camera's height: smaller ones are the floor's
  double least_share = 0.7;    ///< of images that show floor
  double least_ratio = 0.05;   ///< of scans' way over wheels': carpets do as much
  StepChangeOptions step = {};
};

/// Follows step by step what a recording's sensors say of each other, as medians by blocks: way by
/// scans over way by wheels; the tilt under which the camera sees its floor, how high it is over
/// the largest level plane, how many images show one. A step in one of them is a camera that was
/// knocked, a unit that changed, a scanner or wheels that became others. What was estimated before
/// it, or over both, holds for neither.
class SensorChanges {
 public:
  explicit SensorChanges(const SensorChangeOptions& options = {}) : options_(options) {}

  void add(const Step& step);
  /// Warnings "camera_changes" and "ranges_change", with when, from and to.
  std::vector<Warning> warnings() const;

 private:
  /// Medians of blocks of values, each with its first stamp.
  class Series {
   public:
    /// A value; a new block begins where the last one is `length` s long.
    void add(Timestamp stamp, double value, double length);
    struct Found {
      StepChange change;
      Timestamp at;
    };
    std::optional<Found> step(double least, const StepChangeOptions& options) const;
    const std::vector<double>& medians() const { return medians_; }

   private:
    std::vector<Timestamp> from_;
    std::vector<double> medians_, block_;
  };
  void add_camera(const Step& step);
  void add_ways(const Step& step);

  SensorChangeOptions options_;
  Series roll_, pitch_, height_, floors_, ratio_;
  std::optional<SE3> T_start_image_;  ///< of the body at the last image that counts
  PairedMotion piece_;
};

}  // namespace lamina
