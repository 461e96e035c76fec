// Words for a status, and the way to the backend.
#include <lamina/frontend/depth/floor_result.hpp>

namespace lamina {

const char* to_string(FloorStatus status) {
  constexpr const char* kNames[] = {"found",    "no data",   "no planes",
                                    "no floor", "too small", "ambiguous"};
  return kNames[static_cast<int>(status)];
}

Observations FloorResult::to_observations() const {
  Observations result;
  result.stamp = stamp;
  result.sensor = sensor;
  result.T_body_sensor = mounting.T_body_camera;
  result.planes.reserve(planes.size());
  for (const ExtractedPlane& plane : planes) {
    result.planes.push_back(
        {plane.plane_camera, plane.moments_camera, plane.floor, plane.outline_camera, plane.kind});
  }
  result.floor_patches = floor_patches;
  result.surfels_body = surfels_body;
  result.obstacle_points_body = obstacle_points_body;
  return result;
}

}  // namespace lamina
