// What steps are corrected by before they are mapped, and what the user is told of it.
#pragma once

#include <functional>
#include <vector>

#include <lamina/backend/mapper/mapper_options.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/loops/loop_closer.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/pipeline/calibration/motion_refinement.hpp>
#include <lamina/pipeline/calibration/wheel_scale.hpp>

namespace lamina {

/// calibrate_wheels() where there are no scans, with its corrections in the log and among the
/// counts of `metrics`. Images that have the way longer than wheels by more than wheels wear is a
/// warning; where the floor lies as much below `stated`'s camera, of depths, and wheels stay.
/// Sigmas of scale, drift (rad/m) and turn scale where they were corrected.
std::optional<Eigen::Vector3d> correct_wheels(std::vector<Step>& steps, const Calibration& stated,
                                              const MapperOptions& options, bool remounting,
                                              Diagnostics& metrics,
                                              const std::function<bool()>& ended);

/// calibrate_mountings(), likewise. Returns what is left.
MountingEvidence correct_mountings(std::vector<Step>& steps, std::vector<LoopClosure>& loops,
                                   bool planar, Diagnostics& metrics);

/// A first look over the scans of a level scanner on wheels, for the lean that the ground tells
/// (GroundLean); nullopt where its mounting stays. `recording` is used up.
std::optional<MountingCorrection> find_lean(Recording& recording,
                                            const ScanOdometryOptions& options,
                                            Diagnostics& metrics,
                                            const std::function<bool()>& ended);

/// What is known of how long a level scanner's beam goes round.
struct Sweep {
  bool stated = false;                      ///< scans say it themselves
  std::optional<SweepFinder::Found> found;  ///< by turns; nullopt: scans fit as they are
  bool adopted() const { return found && found->adoption.adopted; }
};

/// Says what was found and whether it counts, in the log and in metrics.json.
void tell_sweep(const SweepFinder::Found& found, Diagnostics& metrics);

/// A first look over the scans of a level scanner, for its sweep. `recording` is used up.
Sweep find_sweep(Recording& recording, const ScanOdometryOptions& options,
                 const std::function<bool()>& ended);

/// A first look over the scans of level scanners on wheels, for the wheels' scale (WheelScale),
/// until that is told; nullopt where it cannot be, or beside a camera matters less than the wheels'
/// noise. `told` has been told all else of the scanners. `recording` is used up.
std::optional<WheelScale::Found> find_wheel_scale(Recording& recording,
                                                  const CalibrationOptions& settings,
                                                  const FrontEnd& observed,
                                                  const std::function<bool()>& ended);
/// Log and counts; true where it is to be taken out. `without`: beyond its bound the map is made
/// without the wheels.
bool tell_wheel_scale(const WheelScale::Found& found, bool without, Diagnostics& metrics);

/// All odometry of a recording: what a scan's beams went through comes after its stamp.
/// `recording` is used up.
WheelTrack all_wheels(Recording& recording, const std::function<bool()>& ended);

/// follow_slopes() where there are scans of level scanners, likewise. True where there are slopes.
bool lift_off_plane(const OpenRecording& open, const DepthDistortion& distortion,
                    std::vector<Step>& steps, Diagnostics& metrics,
                    const std::function<bool()>& ended);

/// refine_motions_by_images() where there are no scans, likewise. Returns what images say of the
/// camera's mounting as it is then.
MountingEvidence correct_motions_by_images(const OpenRecording& open,
                                           const DepthDistortion& distortion,
                                           std::vector<Step>& steps, bool remounting,
                                           Diagnostics& metrics,
                                           const std::function<bool()>& ended);

}  // namespace lamina
