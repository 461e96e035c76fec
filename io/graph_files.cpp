// The text form of [g2o].
#include <lamina/io/graph_files.hpp>

#include <cstdio>
#include <ostream>
#include <string>

#include <lamina/io/atomic_file.hpp>

namespace lamina::io {
namespace {

std::string number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, " %.12g", value);
  return buffer;
}

std::string pose_text(const SE3& T) {
  std::string text;
  for (int i = 0; i < 3; ++i) text += number(T.translation()(i));
  for (int i = 0; i < 4; ++i) text += number(T.so3().quaternion().coeffs()(i));
  return text;
}

// Upper triangle of the information in g2o's tangent, row by row.
std::string information_text(const Matrix6d& sqrt_information) {
  Matrix6d scaled = sqrt_information;
  scaled.rightCols<3>() *= 2.0;
  const Matrix6d information = scaled.transpose() * scaled;
  std::string text;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) text += number(information(i, j));
  }
  return text;
}

std::string edge_text(KeyframeId from, KeyframeId to, const SE3& T_from_to,
                      const Matrix6d& sqrt_information) {
  return "EDGE_SE3:QUAT " + std::to_string(static_cast<std::int64_t>(from)) + " " +
         std::to_string(static_cast<std::int64_t>(to)) + pose_text(T_from_to) +
         information_text(sqrt_information) + "\n";
}

// Planar odometry says nothing of height, roll and pitch; other tools still want a definite matrix.
Matrix6d lifted(const Eigen::Matrix3d& planar) {
  constexpr double kWeak = 1e-3;
  Matrix6d S = Matrix6d::Identity() * kWeak;
  const int place[3] = {0, 1, 5};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) S(place[i], place[j]) = planar(i, j);
  }
  return S;
}

}  // namespace

void write_g2o(const std::filesystem::path& file, const Graph& graph) {
  std::string text;
  for (const Keyframe& keyframe : graph.keyframes) {
    const std::string id = std::to_string(static_cast<std::int64_t>(keyframe.id));
    text += "VERTEX_SE3:QUAT " + id + pose_text(keyframe.T_map_body) + "\n";
    if (keyframe.fixed) text += "FIX " + id + "\n";
  }
  for (const PlaneLandmark& landmark : graph.planes) {
    if (!landmark.active) continue;
    const Plane plane = landmark.plane_map();
    text += "VERTEX_PLANE " +
            std::to_string(graph.next_keyframe + static_cast<std::int64_t>(landmark.id)) +
            number(plane.normal().x()) + number(plane.normal().y()) + number(plane.normal().z()) +
            number(-plane.rho()) + "\n";
  }
  for (const auto& f : graph.odometry) {
    text += edge_text(f.from, f.to, f.T_from_to, f.sqrt_information);
  }
  for (const auto& f : graph.planar_odometry) {
    text += edge_text(f.from, f.to, f.T_from_to, lifted(f.sqrt_information));
  }
  for (const auto& f : graph.loops) {
    if (f.weight > 0) text += edge_text(f.from, f.to, f.T_from_to, f.sqrt_information);
  }
  write_atomically(file, text);
}

}  // namespace lamina::io
