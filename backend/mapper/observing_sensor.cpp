// Sensors by kind and place; body axes turned about them.
#include <lamina/backend/mapper/observing_sensor.hpp>

#include <cmath>

#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/mapper/mapper.hpp>

namespace lamina {
namespace {

const char* name_of(SensorKind kind) {
  constexpr const char* kNames[] = {"depth_camera", "stereo_camera", "lidar", "cloud"};
  return kNames[static_cast<int>(kind)];
}

/// Self-calibration moves a mounting by less.
struct OneMounting {
  double near_m = 0.1, alike_deg = 10;
};

bool is_one(const SE3& a, const SE3& b, const OneMounting& limits = {}) {
  const Vector6d off = (a.inverse() * b).log();
  return off.head<3>().norm() < limits.near_m &&
         off.tail<3>().norm() < limits.alike_deg * M_PI / 180;
}

// The motion of what sensors of `scans`, or of images, saw; identity where there are several.
SE3 motion_of(const std::vector<FoundExtrinsics>& found, const Graph& graph, bool scans) {
  const FoundExtrinsics* only = nullptr;
  for (const FoundExtrinsics& f : found) {
    if ((f.sensor == name_of(SensorKind::kLidar)) != scans) continue;
    if (only) return SE3();
    only = &f;
  }
  return only ? only->found * graph.at(only->id).T_body_sensor.inverse() : SE3();
}

}  // namespace

ExtrinsicsId observing_sensor(const Observations& observations, Graph& graph) {
  if (observations.planes.empty() && observations.segments.empty()) return ExtrinsicsId::kNone;
  const char* name = name_of(observations.sensor);
  const SE3& T_body_sensor = observations.T_body_sensor;
  for (const Extrinsics& e : graph.extrinsics) {
    if (e.sensor == name && is_one(e.T_body_sensor, T_body_sensor)) return e.id;
  }
  const Eigen::Vector3d& t = T_body_sensor.translation();
  if (!t.allFinite() || !T_body_sensor.so3().quaternion().coeffs().allFinite())
    return ExtrinsicsId::kNone;
  return graph.add_extrinsics(Extrinsics::at(name, T_body_sensor));
}

std::optional<ExtrinsicsEstimate> Mapper::estimate_extrinsics(
    const ExtrinsicsOptions& options) const {
  if (map_.ground.swells()) return std::nullopt;
  Graph probe = map_.graph;
  add_joint_surfels(probe, map_.surfels, map_.options.joint_surfels);
  if (!probe.surfels.empty()) return std::nullopt;
  return lamina::estimate_extrinsics(probe, options);
}

SensorMotions mount(MapState& map, const std::vector<FoundExtrinsics>& found) {
  const SensorMotions moved{motion_of(found, map.graph, true), motion_of(found, map.graph, false)};
  for (const FoundExtrinsics& f : found) map.graph.at(f.id).state = f.found;
  make_factors_anew(map.graph);
  const auto move = [](const SE3& C, std::vector<Eigen::Vector3d>& points) {
    for (Eigen::Vector3d& p : points) p = C * p;
  };
  for (auto& [id, pieces] : map.outlines) {
    for (OutlinePiece& piece : pieces)
      move(piece.points_body.size() <= 2 ? moved.of_scans : moved.of_images, piece.points_body);
  }
  for (auto& [id, points] : map.loose_body) move(moved.of_images, points);
  map.surfels = map.surfels.moved(moved.of_images);
  return moved;
}

}  // namespace lamina
