// The text form of [g2o].
#include <lamina/io/graph_files.hpp>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <optional>
#include <ostream>
#include <set>
#include <string>

#include <lamina/io/atomic_file.hpp>
#include <lamina/models/linalg.hpp>

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

std::int64_t plane_vertex(const Graph& graph, PlaneId id) {
  return graph.next_keyframe + static_cast<std::int64_t>(id);
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

// A plane in g2o's terms is (n, -rho), and an error between two planes is taken in a frame whose x
// lies along the normal of the one that is estimated: azimuth and elevation of the other's normal
// there, and the difference of their distances (Plane3D::ominus of g2o's types_slam3d_addons).
// These are the frame's y and z.
Matrix32d g2o_tangent(const Eigen::Vector3d& normal) {
  const double azimuth = std::atan2(normal.y(), normal.x());
  const double elevation = std::atan2(normal.z(), normal.head<2>().norm());
  Matrix32d B;
  B << -std::sin(azimuth), -std::sin(elevation) * std::cos(azimuth),  //
      std::cos(azimuth), -std::sin(elevation) * std::sin(azimuth),    //
      0, std::cos(elevation);
  return B;
}

// Azimuths turn about the pole with the least change of a normal there. What does not depend on
// them, and claims no more: the two tilts alike, apart from the distance, at half the information.
Eigen::Matrix3d without_azimuth(const Eigen::Matrix3d& information) {
  const Eigen::Matrix3d C = information.inverse();
  const Eigen::Matrix2d tilts = C.topLeftCorner<2, 2>();
  const double tilt = 0.5 / symmetric_eigen(tilts).values(1);
  return Eigen::Vector3d(tilt, tilt, 0.5 / C(2, 2)).asDiagonal();
}

struct MeasuredPlane {
  Plane plane_body;
  Eigen::Matrix3d information;  // azimuth, elevation (rad), distance (m)
};

// The plane that moments tell by themselves, facing as `expected_body`, the estimate; nullopt for
// views in part, which leave a tilt open. With e the error above, mu the mean, S the scatter less
// its least eigenvalue, w the weight and B the tangent, the cost of the estimate beyond the plane's
// own is  e_t^T (B^T S B) e_t + w (mu^T B e_t + e_d)^2:  the estimate's normal is off by -B e_t.
std::optional<MeasuredPlane> measured_plane(const Moments& body, const Plane& expected_body) {
  constexpr double kOpenTilt = 0.3;     // rad, 1-sigma
  constexpr double kNearPole = 0.1736;  // sine of 10 degrees
  if (!(body.weight() > 0) || !body.scatter().allFinite()) return std::nullopt;
  const SymmetricEigen<3> eigen = symmetric_eigen(body.scatter());
  if (!(eigen.values(1) - eigen.values(0) > 1 / (kOpenTilt * kOpenTilt))) return std::nullopt;
  Eigen::Vector3d n = eigen.vectors.col(0);
  if (n.dot(expected_body.normal()) < 0) n = -n;
  const auto plane = Plane::from_normal_rho(n, n.dot(body.mean()));
  if (!plane) return std::nullopt;
  const Matrix32d B = g2o_tangent(expected_body.normal());
  const Eigen::Matrix3d S = body.scatter() - eigen.values(0) * Eigen::Matrix3d::Identity();
  Eigen::Vector3d lever;
  lever << B.transpose() * body.mean(), 1;
  Eigen::Matrix3d information = body.weight() * lever * lever.transpose();
  information.topLeftCorner<2, 2>() += B.transpose() * S * B;
  const bool near_pole = expected_body.normal().head<2>().norm() < kNearPole;
  return MeasuredPlane{*plane, near_pole ? without_azimuth(information) : information};
}

std::string plane_text(const Plane& plane) {
  return number(plane.normal().x()) + number(plane.normal().y()) + number(plane.normal().z()) +
         number(-plane.rho()) + " 0.5 0.5 0.5";  // a colour, which g2o wants there
}

// EDGE_SE3_PLANE_CALIB keyframe plane offset: measurement, colour, upper triangle of information.
std::string plane_edge_text(const Graph& graph, const PlaneMomentsFactor& f, std::int64_t offset) {
  const Keyframe* keyframe = graph.find(f.keyframe);
  const PlaneLandmark* landmark = graph.find(f.plane);
  const bool by_body = f.extrinsics == ExtrinsicsId::kNone;  // else the mounting is a state, too
  if (!keyframe || !landmark || !landmark->active || !(f.weight > 0) || !by_body) return "";
  const auto measured =
      measured_plane(f.moments_body, keyframe->T_map_body.inverse() * landmark->plane_map());
  if (!measured) return "";
  std::string text = "EDGE_SE3_PLANE_CALIB " +
                     std::to_string(static_cast<std::int64_t>(f.keyframe)) + " " +
                     std::to_string(plane_vertex(graph, f.plane)) + " " + std::to_string(offset) +
                     plane_text(measured->plane_body);
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) text += number(f.weight * measured->information(i, j));
  }
  return text + "\n";
}

// Planes and where they were seen from. Planes without a full view hang on nothing: held.
std::string plane_lines(const Graph& graph, std::string& edges) {
  const std::int64_t offset = graph.next_keyframe + graph.next_plane;
  std::set<PlaneId> seen;
  for (const auto& f : graph.plane_moments) {
    const std::string edge = plane_edge_text(graph, f, offset);
    if (!edge.empty()) seen.insert(f.plane);
    edges += edge;
  }
  std::string vertices;
  for (const PlaneLandmark& landmark : graph.planes) {
    if (!landmark.active) continue;
    const std::string id = std::to_string(plane_vertex(graph, landmark.id));
    vertices += "VERTEX_PLANE " + id + plane_text(landmark.plane_map()) + "\n";
    if (landmark.fixed || seen.count(landmark.id) == 0) vertices += "FIX " + id + "\n";
  }
  if (seen.empty()) return vertices;
  const std::string id = std::to_string(offset);
  return vertices + "VERTEX_SE3:QUAT " + id + pose_text(SE3()) + "\nFIX " + id + "\n";
}

}  // namespace

void write_g2o(const std::filesystem::path& file, const Graph& graph) {
  std::string text;
  for (const Keyframe& keyframe : graph.keyframes) {
    const std::string id = std::to_string(static_cast<std::int64_t>(keyframe.id));
    text += "VERTEX_SE3:QUAT " + id + pose_text(keyframe.T_map_body) + "\n";
    if (keyframe.fixed) text += "FIX " + id + "\n";
  }
  std::string plane_edges;
  text += plane_lines(graph, plane_edges);
  for (const auto& f : graph.odometry) {
    text += edge_text(f.from, f.to, f.T_from_to, f.sqrt_information);
  }
  for (const auto& f : graph.planar_odometry) {
    text += edge_text(f.from, f.to, f.T_from_to, lifted(f.sqrt_information));
  }
  for (const auto& f : graph.loops) {
    if (f.weight > 0) text += edge_text(f.from, f.to, f.T_from_to, f.sqrt_information);
  }
  write_atomically(file, text + plane_edges);
}

}  // namespace lamina::io
