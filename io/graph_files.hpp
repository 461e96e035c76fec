// graph.g2o: keyframes, planes and constraints for other tools.
#pragma once

#include <filesystem>
#include <vector>

#include <lamina/backend/graph.hpp>
#include <lamina/models/planar_map.hpp>

namespace lamina::io {

/// VERTEX_SE3:QUAT (keyframes), EDGE_SE3:QUAT (odometry and loops), VERTEX_PLANE (active planes,
/// n.x + d = 0 with d = -rho; ids follow those of the keyframes), FIX of the held ones.
/// Information is given in g2o's tangent: translation, then the vector part of the quaternion,
/// which is half the rotation vector, hence blocks times 2 and 4.
void write_g2o(const std::filesystem::path& file, const Graph& graph);

}  // namespace lamina::io
