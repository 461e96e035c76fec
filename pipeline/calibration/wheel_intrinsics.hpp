// Wheels that err in a lawful way, found by the map they give.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <lamina/backend/mapper/mapper_options.hpp>
#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/segments/mounting_correction.hpp>
#include <lamina/models/adoption.hpp>

namespace lamina {

/// No scan among the steps: nothing but wheels told the motion between images, and an error of
/// theirs in every step bends the map. Level scanners are matched scan by scan; one that looks
/// another way tells too little of the path for this.
bool wheels_and_images_alone(const std::vector<Step>& steps);

/// Where the first camera is said to sit (m, body x and y).
Eigen::Vector2d camera_place(const std::vector<Step>& steps);

/// The motion is the wheels' own word.
bool observed_by_wheels(const Step& step);

/// The motion is that of the step's own sensor: its scans matched, or its images.
bool observed_by_sensor(const Step& step);

/// Depth images, stereo pairs or clouds, and not two of these.
bool one_kind_of_camera(const std::vector<Step>& steps);

/// The refined graph of the steps, motions that wheels told corrected by `errors`. For what it
/// tells of sensors: refined once, not thoroughly.
Graph quick_map(const std::vector<Step>& steps, const WheelErrors::Vector& errors,
                const MapperOptions& options, const std::function<bool()>& ended);

/// What is wrong with wheels, and what has to be done to the cameras' mountings.
struct WheelCalibration {
  WheelErrors errors;
  MountingCorrection cameras;
  Adoption adoption;  ///< by blocks left out (evidence_by_blocks)
};

/// Maps the steps, estimates scale, drift and turn scale of the wheels, and heading and place of
/// the cameras against their direction of travel and the point they turn about, with the refined
/// graph, and goes on with motions so corrected until the estimate stays. nullopt where there is
/// nothing to tell. Mountings stay without `remounting`, and where several kinds of camera share
/// them: which of them errs cannot be observed. `ended` returning true stops early.
std::optional<WheelCalibration> calibrate_wheels(const std::vector<Step>& steps,
                                                 const MapperOptions& options, bool remounting,
                                                 const std::function<bool()>& ended);

/// Replaces what wheels measured of the motions, and the cameras' mountings.
void apply_correction(std::vector<Step>& steps, const WheelCalibration& found);

}  // namespace lamina
