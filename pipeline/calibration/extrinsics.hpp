// Mountings that what was seen contradicts, corrected before the map is made.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/loops/loop_closer.hpp>
#include <lamina/frontend/segments/mounting_correction.hpp>
#include <lamina/pipeline/calibration/mounting_evidence.hpp>

namespace lamina {

/// One sensor's mounting as it was corrected.
struct CorrectedMounting {
  std::string sensor;  ///< "scanner" or "camera"
  std::string source;  ///< what told it
  MountingCorrection correction;
  /// 1-sigma (rad, m), zero where none was told.
  Eigen::Vector3d sigma_turn = Eigen::Vector3d::Zero(), sigma_move = Eigen::Vector3d::Zero();
  double score = 0;  ///< Adoption::gain, where blocks were left out
};

/// A place of a level scanner that its turns contradict, beyond what mountings are measured to (m,
/// body x and y).
struct MountingContradiction {
  Eigen::Vector2d stated, found, sigma;
  bool corrected = false, cameras_too = false;  ///< which moved with it
};

/// What was corrected, and what wheels say of the level scanner's mounting as it is then.
struct MountingCalibration {
  std::vector<CorrectedMounting> corrected;
  std::optional<MountingContradiction> contradiction;
  MountingEvidence left;
};

/// Moves the step's sensor, and all that the step holds in the frame of the body with it.
void apply_correction(Step& step, const MountingCorrection& correction);

/// Motions and loops that a level scanner measured which was stated to sit elsewhere: T_new_old
/// turns and moves what it saw, body axes. What wheels alone measured stays.
void turn_path(std::vector<Step>& steps, std::vector<LoopClosure>& loops, const SE3& T_new_old);

/// Corrects mountings in all steps, and motions and loops that were worked out with them:
///   an upright scanner's lean and height by the ground under wheels (GroundLines),
///   a camera's heading and place by walls that a level scanner sees, too (SharedWalls),
///   the heading of a level scanner by the wheels' direction of travel, and its place across the
///   floor by turns (MountingError); cameras move with it. A place beyond four prior sigmas is a
///   contradiction, corrected where it wins by 50; cameras whose walls then lie on the scanner's
///   stay.
/// Corrections that do not stand out from chance are left, and scanners of which there are several.
/// `planar`: the body stands on a floor.
MountingCalibration calibrate_mountings(std::vector<Step>& steps, std::vector<LoopClosure>& loops,
                                        bool planar);

}  // namespace lamina
