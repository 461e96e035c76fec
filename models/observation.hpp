// What crosses from the front-ends to the backend. The most important file of the middle.
//
// The only frontend header that backend/ includes: it knows models/ alone.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include <lamina/models/moments.hpp>
#include <lamina/models/plane.hpp>
#include <lamina/models/scan_segment.hpp>
#include <lamina/models/surfel.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// Which sensor: its T_body_sensor stands in the Observations.
enum class SensorKind { kDepth, kStereo, kLidar, kCloud };

/// What a front-end thinks a plane is to a robot. A hint: the map's labels are decided later.
enum class PlaneKind { kDominantFloor, kSubDominant, kObstacle, kUnknown };

/// A plane seen in one depth image or cloud. All geometry in the sensor frame.
struct PlaneObservation {
  Plane plane_sensor;                           ///< fitted, normal towards the sensor
  Moments moments_sensor;                       ///< weights 1/sigma^2 along the normal (1/m^2)
  NoiseFloor floor;                             ///< what its points share
  std::vector<Eigen::Vector3d> outline_sensor;  ///< closed, on the plane; may be concave
  PlaneKind kind = PlaneKind::kUnknown;
};

/// A straight piece of a 2D scan, tracked. Geometry in the scanner frame (scan in x-y).
struct SegmentObservation {
  ScanSegment segment;
  NoiseFloor floor;
  std::int64_t track = -1;  ///< the tracker's id: the same plane while it is followed; -1: none
};

/// Floor points of one small patch: evidence for a surfel cell. In the sensor frame.
struct FloorPatch {
  Moments moments_sensor;  ///< weights 1/sigma^2 along the floor's normal (1/m^2)
  NoiseFloor floor;
};

/// All that one measurement gave.
struct Observations {
  Timestamp stamp;
  SensorKind sensor = SensorKind::kLidar;
  SE3 T_body_sensor;  ///< as calibrated, corrected by self-calibration where there was any
  /// Where the floor under the first pose lies in the map, as far as that is known: through the
  /// origin of a robot on wheels.
  std::optional<Plane> first_floor_map;
  /// Where up is, of a body that tilts with the ground: what a level scanner sees is upright on it.
  Eigen::Vector3d up_body = Eigen::Vector3d::UnitZ();
  std::vector<PlaneObservation> planes;
  std::vector<SegmentObservation> segments;
  std::vector<FloorPatch> floor_patches;
  std::vector<Surfel> surfels_body;                   ///< the floor front-end's, for display
  std::vector<Eigen::Vector3d> obstacle_points_body;  ///< loose points a robot would hit
};

}  // namespace lamina
