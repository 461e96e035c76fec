// Settings of the floor front-end: one struct, every member with unit, default and reason.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lamina {

struct FloorOptions {
  // Region of interest and its sub-sections, in the levelled body frame (x forward, y left).
  std::array<double, 3> roi_m{4.9, 4.0, 0.75};  ///< length (x), width (y), height: the document's
  std::array<int, 2> sections{4, 3};            ///< sub-sections along x and y: the document's best
  double roi_depth_below_m =
      0.75;                   ///< m below the floor that still belongs to the ROI (steps down)
  double time_budget_ms = 0;  ///< 0: none. Else the farthest sections are left out, and named

  // Blocks and outliers.
  int block_px = 8;            ///< side of a pixel block; 8 keeps sums in two SIMD registers
  double outlier_alpha = 3.0;  ///< sigmas from the neighbours' mean beyond which a pixel is dropped
  double min_block_fill = 0.5;  ///< share of a block's pixels that must be valid for a hypothesis

  // Recursive RANSAC.
  std::uint64_t seed = 1;        ///< of the block samples; same seed, same result
  int hypotheses = 12;           ///< samples a recursion step tries
  int recursion_limit = 6;       ///< planes a sub-section may give
  double distance_sigmas = 4.0;  ///< distance threshold in sigmas of a block's mean
  double prior_cone_deg = 25.0;  ///< floor normals are looked for inside this cone about the prior
  double unknown_cone_deg = 40.0;  ///< the same while the mounting is not yet known
  int min_plane_px = 600;          ///< smaller planes are not reported

  // What a plane is to a robot.
  double traversable_slope_deg = 20.0;  ///< steeper planes are obstacles
  double max_level_m = 0.4;             ///< m above the floor up to which a level plane is no table
  double min_level_area_m2 = 0.5;       ///< m^2 from which a level plane is a floor, not a plate
  double dominant_min_share = 0.02;     ///< of the frame's pixels a dominant floor must hold
  double dominant_min_area_m2 = 0.25;   ///< m^2 of floor seen: less cannot carry a calibration

  // Self-calibration.
  bool self_calibrate = true;
  double report_change_deg = 0.2;  ///< a tracked change above this is reported
  double process_deg = 0.002;      ///< deg per frame: how fast a sound mounting may creep
  double process_height_m = 2e-5;  ///< m per frame
  double mounting_gate = 14.2;     ///< chi-squared (3, .27 %): a stated mounting beyond is wrong
  double ground_frames = 100;      ///< images that the ground's unevenness is of
  double facing_share = 0.2;       ///< of unevenness: no number of frames takes it out, see tracker
  double max_unevenness_deg = 1.5;  ///< floors that scatter more: a hand holds the camera
  int confirm_frames = 15;          ///< a jump is believed after so many frames that agree
  double max_height_m = 3.0;        ///< cameras higher than this above a plane do not stand on it
  double min_height_m = 0.1;

  // Low obstacles.
  double cell_m = 0.05;                  ///< side of a ground cell
  double false_alarm = 1e-3;             ///< per cell of flat floor: share called raised or lowered
  double min_obstacle_height_m = 0.005;  ///< lower ones are no obstacles to any robot
  int min_obstacle_cells = 3;            ///< least connected cells
  double local_floor_m = 0.6;  ///< m: radius over which the floor is refitted for the test

  // Surfels.
  double surfel_m = 0.2;  ///< side of the patch a surfel stands for

  /// All that is wrong with the settings, one line each; empty when they can be used.
  std::vector<std::string> problems() const;
};

}  // namespace lamina
