// What the floor front-end finds in one frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lamina/frontend/depth/floor_surface.hpp>
#include <lamina/models/ground_look.hpp>
#include <lamina/models/observation.hpp>

namespace lamina {

/// Whether a floor dominates the frame, and if not, why.
enum class FloorStatus {
  kFound,
  kNoData,     ///< too few measurements for any plane
  kNoPlanes,   ///< measurements, but nothing plane
  kNoFloor,    ///< planes, but none that can be a floor (a wall, a ceiling)
  kTooSmall,   ///< a floor, but too little of it to level anything by
  kAmbiguous,  ///< several levels or slopes that claim to be the floor (stairs, a ramp alone)
};
/// "found", "no data", ... for messages.
const char* to_string(FloorStatus status);

/// Correction of the sensor's mounting against what calibration says: the tracked state.
struct MountingEstimate {
  SE3 T_body_camera;  ///< tracked: x, y and heading as calibrated; pitch, roll, height ours
  double pitch = 0, roll = 0;  ///< rad, correction about body y and x against calibration
  double height = 0;           ///< m, of the optical centre above the floor
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (pitch, roll, height)
  int frames = 0;        ///< frames that went in; 0: calibration as given
  bool changed = false;  ///< this frame moved the estimate by more than report_change_deg
  bool rigid = true;     ///< false: frames disagree more than noise allows (hand-held)
};

template <class A>
void fields(A& a, MountingEstimate& v) {
  a(v.T_body_camera, v.pitch, v.roll, v.height, v.covariance, v.frames, v.changed, v.rigid);
}

constexpr double kUprightSlope = 1;  ///< rad: planes this steep stand upright

/// A whole plane, merged over sub-sections. Camera frame: optical.
struct ExtractedPlane {
  Plane plane_camera;      ///< normal towards the camera
  Plane plane_body;        ///< the same in the levelled body frame
  Moments moments_camera;  ///< weights 1/sigma^2 along the normal, effective samples
  NoiseFloor floor;
  PlaneKind kind = PlaneKind::kUnknown;
  std::vector<Eigen::Vector3d> outline_camera;          ///< closed, on the plane
  Eigen::Vector3d disparity = Eigen::Vector3d::Zero();  ///< d = x u + y v + z (px); 0 for clouds
  Eigen::Vector3d centroid_camera = Eigen::Vector3d::Zero();
  std::int64_t pixels = 0;
  double area = 0;    ///< m^2 seen, on the plane
  double slope = 0;   ///< rad, angle between its normal and body z
  double height = 0;  ///< m, body z of its centroid
  double rms_px = 0;  ///< residual, px of disparity (m for clouds)
};

/// Labels of pixel blocks; block (c, r) covers block_px squares from pixel (c, r) * block_px.
struct BlockLabels {
  int block_px = 8, columns = 0, rows = 0;
  std::vector<std::int16_t> plane;  ///< index into FloorResult::planes, -1: none
  std::int16_t at(int c, int r) const {
    return plane[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(c)];
  }
};

/// A connected patch of ground that is raised above, or sunk below, the floor beside it.
struct LowObstacle {
  Eigen::Vector2d center_body = Eigen::Vector2d::Zero();
  double height = 0;                       ///< m against the floor beside it; negative: sunk
  double sigma = 0;                        ///< m, standard error including what its pixels share
  double probability = 0;                  ///< that it is an obstacle rather than noise
  std::vector<std::pair<int, int>> cells;  ///< of FloorResult::surface
};

/// CPU time of the calling thread.
struct FloorStageTimes {
  double disparity_ms = 0, blocks_ms = 0, planes_ms = 0, refine_ms = 0, surface_ms = 0,
         output_ms = 0;
  /// The plane stage of the issue: all up to whole planes and labels.
  double plane_stage_ms() const { return disparity_ms + blocks_ms + planes_ms + refine_ms; }
  double total_ms() const { return plane_stage_ms() + surface_ms + output_ms; }
};

struct FloorResult {
  Timestamp stamp;
  SensorKind sensor = SensorKind::kDepth;
  FloorStatus status = FloorStatus::kNoData;
  std::string reason;  ///< one line for people where status is not kFound; else empty

  int dominant = -1;                  ///< index of the dominant floor in `planes`, -1: none
  std::optional<Plane> floor_camera;  ///< the dominant floor, camera frame
  /// Levelled by this frame's floor: the dominant floor is z = 0 of body. Where the status is not
  /// kFound: the tracked mounting. All *_body quantities of this result are in this frame.
  SE3 T_body_camera;
  MountingEstimate mounting;  ///< the tracked mounting, this frame included

  std::vector<ExtractedPlane> planes;      ///< largest first
  BlockLabels blocks;                      ///< organised input only
  std::vector<std::uint8_t> pixel_labels;  ///< organised: row-major, plane index + 1, 0: none
  FloorSurface surface;                    ///< empty when no floor was found
  std::vector<LowObstacle> low_obstacles;
  GroundLook look;  ///< by cell: floor, something raised or sunk; for votes over images
  std::vector<Surfel> surfels_body;
  std::vector<FloorPatch> floor_patches;              ///< camera frame, one a surfel
  std::vector<Eigen::Vector3d> obstacle_points_body;  ///< above the floor, on no plane
  std::vector<std::pair<int, int>> skipped_sections;  ///< dropped by the time budget
  FloorStageTimes times;
  /// Noise of this image's pixels over what its calibration says, 1 to 4 (not told: 1): that of
  /// the quieter quarter of its blocks about planes of their own.
  double noise_scale = 1;

  /// Label of a pixel: index into `planes`, -1: none.
  int plane_at(int u, int v, int width) const {
    return static_cast<int>(
               pixel_labels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(u)]) -
           1;
  }
  /// What goes to the backend. T_body_sensor is the tracked mounting: one rigid body.
  Observations to_observations() const;
};

}  // namespace lamina
