// Farthest contiguous floor: one way outward, pixel by pixel, until the floor ends.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <lamina/frontend/depth/floor_result.hpp>
#include <lamina/frontend/obstacles/scan_options.hpp>
#include <lamina/frontend/obstacles/scan_view.hpp>
#include <lamina/sensors/obstacle_scan.hpp>

namespace lamina {

/// A plane the robot may drive on, in disparity and in the body frame.
struct WalkPlane {
  Eigen::Vector3f disparity = Eigen::Vector3f::Zero();  ///< d = x (u - cx) + y (v - cy) + z
  Eigen::Vector3f body = Eigen::Vector3f::Zero();       ///< z = x X + y Y + z
  float camera_height = 0;  ///< m, distance of the optical centre from the plane
  bool entered = false;     ///< a walk came over it: it can be driven on
};

/// The planes of a result that are floor (the dominant one first), and which label is which.
struct WalkPlanes {
  std::vector<WalkPlane> planes;
  float slack = 0;  ///< m added to tolerances: the floor is the tracked mounting's, not the frame's
  std::vector<std::int16_t> of_label;  ///< pixel label (0: none) -> index in planes, -1: no floor
};
WalkPlanes walk_planes(const FloorResult& floor, const ScanView& view, const ScanOptions& options);

/// How a walk ended.
struct WalkEnd {
  BeamCause cause = BeamCause::kNone;
  double range = 0;      ///< m from the camera's foot, along the line: where floor ends
  double footprint = 0;  ///< m of floor one sample covers there
  double gap = 0;        ///< m of unseen ground before what ended the walk; 0: none
  float height = 0;      ///< m, body z of the floor there
  int sample = -1;       ///< last sample on floor, -1: no floor was met
  double beyond = 0;     ///< m, holes: the virtual floor point of the first ground seen below
  double beyond_footprint = 0;  ///< m of floor one sample would cover there
  double unseen = 0;   ///< m, holes where floor faded: unseen ground behind the range; the rim may
                       ///< lie anywhere on it
  int plane = 0;       ///< the floor walked on last, index into WalkPlanes::planes
  bool faded = false;  ///< holes: the sensor was losing the floor before the rim
  std::uint32_t history = 0;  ///< one bit a sample back from the last: was it floor?
  bool sharp = false;         ///< floor was seen without holes up to there
  /// Short gaps in sharp floor that were bridged before the end (m): a pit's corner, where
  /// neighbours find it.
  std::array<float, 6> bridged{};
  int bridges = 0;
  bool barred =
      false;  ///< no obstacle behind is to be reported: the ground before it may be a hole
  bool shadow = false;  ///< the gap behind is what a nearer thing hides from the second camera
};

/// How pixels are looked at: four at a time where that is the same, or each by itself. The outcome
/// is the same to the bit; the slow way is there to show it.
enum class Pace { kStrides, kOneByOne };

/// One walk. Each pixel's disparity is compared with that of the floor it should show:
/// - within the tolerance (max_step_m or noise_sigmas of it, whichever is more): floor. A running
///   mean over local_floor_m follows the floor's unevenness; a pixel labelled as another level or
///   ramp takes over when that surface meets the one walked on within max_step_m.
/// - min_run_px pixels nearer: an obstacle. The walk ends before them.
/// - min_run_px pixels farther: a hole. It begins at the last floor.
/// - missing pixels: bridged when floor goes on at the predicted height and the unseen ground is
///   short (max_gap_m, or max_faded_gap_m where the floor fades). Otherwise an edge of knowledge;
///   the caller makes it a ledge where its neighbours agree (find_ledges).
WalkEnd walk(const ScanView& view, const WalkLine& line, std::span<const std::uint8_t> labels,
             WalkPlanes& planes, const ScanOptions& options, Pace pace = Pace::kStrides);

/// Edges of knowledge whose floor ended sharply, at less than grazing incidence and in no shadow,
/// become ledges where most of the four neighbours on each side end alike, within three pixels a
/// line: noise and fading sensors make no straight rims.
void find_ledges(const ScanOptions& options, std::vector<WalkEnd>& ends);

/// Holes that fewer than four of the four neighbours on each side share become edges of knowledge.
/// Where the sensor was fading a rim is the farthest floor seen by those neighbours; where it sees
/// floor no more (lost_deg from the normal of the plane walked on: a ramp that rises is seen
/// farther than the floor), what virtual floor projection says.
void settle_holes(const WalkPlanes& planes, const ScanOptions& options, std::vector<WalkEnd>& ends);

/// Hysteresis: a rim that was found goes on over the neighbouring lines as long as the ground just
/// behind it lies lower than the floor before it by more than noise, however little: at a pit's
/// corner the side of the slab shows a centimetre or less. Its end is known no better than the rim
/// itself: over half a footprint more it is taken to go on straight. Beyond, lines end where the
/// rim would be (an edge of knowledge, barred) until one shows floor there: grazing beams lose
/// samples, and what they do not show they cannot certify. Posts in between are passed by.
void grow_rims(const ScanView& view, const std::vector<WalkLine>& lines, const WalkPlanes& planes,
               std::vector<WalkEnd>& ends);

/// A pit's corner is too short a gap to end a walk by itself. From each hole or ledge sideways:
/// lines whose walk bridged a gap where the neighbour's rim would go on (within three footprints)
/// end there too.
void extend_rims(std::vector<WalkEnd>& ends);

/// Rims are taken as the mean over up to two neighbours on each side that end alike: a pixel's
/// footprint at 3 m is 6 cm for a camera 0.3 m high.
void smooth_edges(std::vector<WalkEnd>& ends);

/// Ends of walks as beams of the body frame: straight pieces between neighbouring ends that belong
/// together, single beams otherwise. `out` gives the beams; `barred`: which of them end at a barred
/// end of knowledge.
void draw_ends(const ScanView& view, const std::vector<WalkLine>& lines,
               const std::vector<WalkEnd>& ends, ObstacleScan& out,
               std::vector<std::uint8_t>& barred);

}  // namespace lamina
