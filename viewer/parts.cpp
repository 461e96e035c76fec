// Planes, paths, keyframes, surfels and points as the page reads them.
#include <lamina/viewer/parts.hpp>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include <lamina/io/map_files.hpp>
#include <lamina/viewer/encode.hpp>

namespace lamina::viewer {
namespace {

using Json = nlohmann::ordered_json;

/// To a tenth of a millimetre: short text, and finer than anything drawn.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

Json rounded(const Eigen::Vector3d& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

Json plane_json(const MapPlane& plane) {
  Json out;
  out["id"] = plane.id;
  out["label"] = to_string(plane.label);
  out["rho"] = plane.plane_map.rho();
  out["theta"] = plane.plane_map.theta();
  out["phi"] = plane.plane_map.phi();
  const io::PlaneSigmas sigmas = io::plane_sigmas(plane);
  out["sigma_rho"] = sigmas.rho;
  out["sigma_angle"] = sigmas.angle;
  const io::PlaneSigmas among_others = io::plane_sigmas(plane.covariance);
  out["own_sigma_rho"] = among_others.rho;
  out["own_sigma_angle"] = among_others.angle;
  out["area"] = plane.area;
  out["normal"] = rounded(plane.plane_map.normal());
  out["observations"] = plane.observations;
  out["unobserved"] = plane.unobserved_directions;
  out["outlines"] = Json::array();
  for (const auto& outline : plane.outlines_map) {
    Json points = Json::array();
    for (const auto& point : outline) points.push_back(rounded(point));
    out["outlines"].push_back(std::move(points));
  }
  return out;
}

void append(std::vector<float>& list, const Eigen::Vector3d& v) {
  for (int k = 0; k < 3; ++k) list.push_back(static_cast<float>(v[k]));
}

}  // namespace

std::string quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', true, Json::error_handler_t::replace);
}

std::string planes_text(const std::vector<MapPlane>& planes) {
  Json list = Json::array();
  for (const MapPlane& plane : planes) list.push_back(plane_json(plane));
  return list.dump();
}

std::string track_text(const Trajectory& trajectory, double start) {
  const std::size_t stride = thinning_stride(trajectory.size(), kMostPoses);
  std::vector<float> times, positions;
  const auto add = [&](const StampedPose& pose) {
    times.push_back(static_cast<float>(pose.stamp.seconds() - start));
    append(positions, pose.pose.translation());
  };
  for (std::size_t i = 0; i < trajectory.size(); i += stride) add(trajectory[i]);
  if (!trajectory.empty() && (trajectory.size() - 1) % stride != 0) add(trajectory.back());
  Json out;
  out["total"] = trajectory.size();
  out["count"] = times.size();
  out["length"] = trajectory.length();
  out["times"] = base64(times);
  out["positions"] = base64(positions);
  return out.dump();
}

std::string keyframes_text(const std::vector<SE3>& T_map_body) {
  const std::size_t stride = thinning_stride(T_map_body.size(), kMostKeyframes);
  std::vector<float> poses;
  for (std::size_t i = 0; i < T_map_body.size(); i += stride) {
    append(poses, T_map_body[i].translation());
    const Eigen::Vector3d ahead = T_map_body[i].so3() * Eigen::Vector3d::UnitX();
    poses.push_back(static_cast<float>(std::atan2(ahead.y(), ahead.x())));
  }
  Json out;
  out["total"] = T_map_body.size();
  out["count"] = poses.size() / 4;
  out["poses"] = base64(poses);
  return out.dump();
}

std::string surfels_text(const std::vector<Surfel>& thinned, std::size_t total) {
  std::vector<float> position, radius;
  std::vector<std::uint8_t> normal;  // int8, 127 = 1
  for (const Surfel& surfel : thinned) {
    append(position, surfel.center);
    for (int k = 0; k < 3; ++k) {
      const double part = surfel.normal[k];
      const double kept = std::isfinite(part) ? std::clamp(part, -1.0, 1.0) : 0.0;
      normal.push_back(
          static_cast<std::uint8_t>(static_cast<std::int8_t>(std::lround(127 * kept))));
    }
    radius.push_back(static_cast<float>(surfel.radius));
  }
  Json out;
  out["count"] = radius.size();
  out["total"] = total;
  out["position"] = base64(position);
  out["normal"] = base64(normal);
  out["radius"] = base64(radius);
  return out.dump();
}

std::string points_text(const std::vector<Eigen::Vector3f>& points_map, std::size_t most) {
  Eigen::Vector3f least = Eigen::Vector3f::Zero(), largest = least;
  bool any = false;
  for (const auto& p : points_map) {
    if (!p.allFinite()) continue;
    least = any ? least.cwiseMin(p).eval() : p;
    largest = any ? largest.cwiseMax(p).eval() : p;
    any = true;
  }
  const double step = std::max(1e-3, static_cast<double>((largest - least).maxCoeff()) / 65535);
  const std::size_t stride = thinning_stride(points_map.size(), most);
  std::vector<std::uint8_t> codes;
  std::size_t count = 0;
  for (std::size_t i = 0; i < points_map.size(); i += stride) {
    if (!points_map[i].allFinite()) continue;
    ++count;
    for (int k = 0; k < 3; ++k) {
      const double offset = static_cast<double>(points_map[i][k]) - static_cast<double>(least[k]);
      const auto code = static_cast<std::uint32_t>(std::clamp(offset / step + 0.5, 0.0, 65535.0));
      codes.push_back(static_cast<std::uint8_t>(code & 255U));
      codes.push_back(static_cast<std::uint8_t>(code >> 8U));
    }
  }
  Json out;
  out["count"] = count;
  out["total"] = points_map.size();
  out["origin"] = {least.x(), least.y(), least.z()};
  out["step"] = step;
  out["codes"] = base64(codes);
  return out.dump();
}

void PointCloud::add(const Eigen::Vector3f& point_map) {
  std::uint64_t key = 0;
  for (int k = 0; k < 3; ++k) {
    const float cell = std::floor(point_map[k] / kCell);
    if (!(std::abs(cell) < 1e6F)) return;  // beyond 20 km, or no number
    key = key << 21U | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + (1 << 20));
  }
  if (cells_.insert(key).second) points_.push_back(point_map);
}

}  // namespace lamina::viewer
