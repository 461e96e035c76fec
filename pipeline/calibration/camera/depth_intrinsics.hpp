// Slopes of a depth image's error and its focal length, found by the map it gives.
#pragma once

#include <functional>
#include <optional>

#include <lamina/backend/parameters/depth_errors.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/models/adoption.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// What was found, and whether blocks left out (evidence_by_blocks) fit better with it.
struct FoundDepthErrors : DepthErrors {
  Adoption slopes, focal;
  /// As the blocks have them, adopted or not: slopes (1/m), focal length (share), and sigmas.
  Eigen::Vector3d alone = Eigen::Vector3d::Zero(), sigma = Eigen::Vector3d::Zero();
};
/// Focal lengths that are stated at all are no further off; beyond, it is something else: of
/// another image size, a scale of the depth, a body that pitches.
inline constexpr double kFocalBound = 0.05;

/// Maps steps of wheels and images of one depth camera and estimates what errors both have in
/// common over all of them (DepthErrors), goes on with steps so corrected until the estimate stays.
/// Slopes and focal length are each free where adopted (the focal length within its bound), else
/// held at zero; slopes and constant first with the 1-sigma `usual` (1/m) of what is smaller, where
/// that is not zero and adopted. nullopt where steps do not tell: no plane, no motion, or `ended`
/// returned true.
std::optional<FoundDepthErrors> depth_errors_of(const std::vector<Step>& steps,
                                                const MapperOptions& options,
                                                const Eigen::Vector3d& usual,
                                                const std::function<bool()>& ended);

/// A look over the first minutes of a recording whose wheels and depth camera tell it:
/// `distortion`, which is taken out of images, with the slopes and the focal length they have
/// beside it. Scans are passed over. Slopes that do not stand out are held to the size that
/// `distortion` makes likely, the focal length to what is stated; nullopt where it is none either,
/// or there are no wheels. `start`: find_tilted_start().
std::optional<DepthDistortion> find_depth_slopes(Recording& recording,
                                                 const CalibrationOptions& settings,
                                                 const DepthDistortion& distortion,
                                                 const std::optional<TiltedStart>& start,
                                                 Diagnostics& metrics,
                                                 const std::function<bool()>& ended);

}  // namespace lamina
