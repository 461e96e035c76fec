// graph.g2o: keyframes, planes and constraints for other tools.
#pragma once

#include <filesystem>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/models/planar_map.hpp>

namespace lamina::io {

/// VERTEX_SE3:QUAT (keyframes), EDGE_SE3:QUAT (odometry and loops), VERTEX_PLANE (active planes,
/// n.x + d = 0 with d = -rho; ids follow those of the keyframes), EDGE_SE3_PLANE_CALIB (full views
/// of planes in the body frame, weights of the last refinement in their information; lines of
/// scanners leave a tilt open and are left out), FIX of what is held: planes without such a view,
/// too. The edges' third vertex, after the planes, is the sensor's place in the body: the identity.
/// Information is given in g2o's tangent: translation, then the vector part of the quaternion,
/// which is half the rotation vector, hence blocks times 2 and 4.
void write_g2o(const std::filesystem::path& file, const Graph& graph);

}  // namespace lamina::io
