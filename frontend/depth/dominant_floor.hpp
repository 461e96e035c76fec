// Which plane is the floor, and when to refuse to say.
#pragma once

#include <span>
#include <string>

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/floor_result.hpp>

namespace lamina {

/// What is known of the mounting when a floor is chosen.
enum class MountingKnowledge {
  kUnknown,     ///< height and tilt are anything
  kFollowed,    ///< not calibrated, but the last floor is known: a hand-held camera
  kCalibrated,  ///< calibration gives it, to some degrees and centimetres
  kTracked,     ///< calibrated, and confirmed by frames before this one
};

struct FloorPrior {
  SE3 T_body_camera;
  MountingKnowledge knowledge = MountingKnowledge::kCalibrated;
  bool rigid() const { return knowledge >= MountingKnowledge::kCalibrated; }
};

struct FloorChoice {
  FloorStatus status = FloorStatus::kNoPlanes;
  int index = -1;      ///< into the planes
  std::string reason;  ///< where status is not kFound
};

/// A camera of unknown mounting that looks steeply down sees its floor like a wall. Where nothing
/// lies inside `unknown_cone_deg`, one plane alone that fills the view is the floor up to this
/// tilt; a level camera's walls lie at 90 deg.
inline constexpr double kSteepConeDeg = 65;

struct FloorCandidate {
  Plane plane_camera;
  double pixels = 0;
  double area = 0;  ///< m^2 on the plane
};

/// Chooses by area seen, weighted by how well the mounting expected it.
/// - A turned mounting leaves the camera's distance from the floor as it was. A plane that is
///   tilted and at another distance is a ramp or a step, not a floor to level by: kAmbiguous.
/// - With nothing known, the lowest of the large planes within `unknown_cone_deg`; two of like size
///   that differ by more than 4 cm or 2 deg (stairs, floor and ramp): kAmbiguous.
///   Where none lies in that cone: the one plane that fills the view, up to kSteepConeDeg.
/// - Less than dominant_min_share of the pixels or dominant_min_area_m2: kTooSmall.
FloorChoice choose_floor(std::span<const FloorCandidate> planes, double frame_pixels,
                         const FloorPrior& prior, const FloorOptions& options);

}  // namespace lamina
