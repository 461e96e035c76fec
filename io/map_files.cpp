// The text files of a map.
#include <lamina/io/map_files.hpp>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <ostream>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/decimal_seconds.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json to_json(const std::vector<Eigen::Vector3d>& points) {
  Json array = Json::array();
  for (const auto& point : points) array.push_back(to_json(point));
  return array;
}

Eigen::Vector3d vector_of(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

std::vector<Eigen::Vector3d> points_of(const Json& json) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& point : json) points.push_back(vector_of(point));
  return points;
}

// (tilt, tilt, rho) to (normal, rho), which know of no basis.
Eigen::Matrix<double, 4, 3> by_tangent(const Plane& plane) {
  Eigen::Matrix<double, 4, 3> J = Eigen::Matrix<double, 4, 3>::Zero();
  J.topLeftCorner<3, 2>() = plane.tangent_basis();
  J(3, 2) = 1;
  return J;
}

Json to_json(const Eigen::Matrix3d& covariance, const Plane& plane) {
  const Eigen::Matrix<double, 4, 3> J = by_tangent(plane);
  const Eigen::Matrix4d C = J * covariance * J.transpose();
  Json upper;
  for (int i = 0; i < 4; ++i) {
    for (int j = i; j < 4; ++j) upper.push_back(C(i, j));
  }
  return upper;
}

Eigen::Matrix3d covariance_of(const Json& upper, const Plane& plane) {
  Eigen::Matrix4d C;
  std::size_t k = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i; j < 4; ++j) C(i, j) = C(j, i) = upper.at(k++).get<double>();
  }
  const Eigen::Matrix<double, 4, 3> J = by_tangent(plane);
  return J.transpose() * C * J;
}

Json to_json(const MapPlane& plane) {
  const PlaneSigmas sigmas = plane_sigmas(plane);
  Json json;
  json["id"] = plane.id;
  json["label"] = to_string(plane.label);
  json["normal"] = to_json(plane.plane_map.normal());
  json["rho"] = plane.plane_map.rho();
  json["theta"] = plane.plane_map.theta();
  json["phi"] = plane.plane_map.phi();
  json["sigma_rho"] = sigmas.rho;
  json["sigma_angle"] = sigmas.angle;
  json["covariance"] = to_json(plane.covariance, plane.plane_map);
  json["covariance_mounting"] = to_json(plane.covariance_mounting, plane.plane_map);
  const bool no_ring = plane.ring_map.empty() && !plane.outlines_map.empty();
  json["boundary"] = to_json(no_ring ? plane.outlines_map.front() : plane.ring_map);
  json["area"] = plane.area;
  json["observations"] = plane.observations;
  json["first_seen"] = decimal_seconds(plane.first_seen);
  json["last_seen"] = decimal_seconds(plane.last_seen);
  json["centroid"] = to_json(plane.centroid_map);
  json["unobserved_directions"] = plane.unobserved_directions;
  if (plane.outlines_map.size() > 1) {
    for (const auto& outline : plane.outlines_map) json["parts"].push_back(to_json(outline));
  }
  return json;
}

PlaneLabel label_of(const std::string& name) {
  for (const PlaneLabel label : {PlaneLabel::kFloor, PlaneLabel::kRamp, PlaneLabel::kStep,
                                 PlaneLabel::kWall, PlaneLabel::kCeiling}) {
    if (name == to_string(label)) return label;
  }
  return PlaneLabel::kOther;
}

MapPlane plane_of(const Json& json) {
  MapPlane plane;
  plane.id = json.at("id").get<std::int64_t>();
  plane.label = label_of(json.at("label").get<std::string>());
  plane.plane_map = Plane(vector_of(json.at("normal")), json.at("rho").get<double>());
  if (json.contains("covariance")) {
    plane.covariance = covariance_of(json.at("covariance"), plane.plane_map);
    plane.covariance_mounting = covariance_of(json.at("covariance_mounting"), plane.plane_map);
  } else {  // older files
    const double rho = json.at("sigma_rho").get<double>();
    const double angle = json.at("sigma_angle").get<double>();
    plane.covariance = Eigen::Vector3d(angle * angle, angle * angle, rho * rho).asDiagonal();
  }
  plane.ring_map = points_of(json.at("boundary"));
  if (json.contains("parts")) {
    for (const auto& outline : json.at("parts")) plane.outlines_map.push_back(points_of(outline));
  } else if (!plane.ring_map.empty()) {
    plane.outlines_map.push_back(plane.ring_map);
  }
  plane.area = json.at("area").get<double>();
  plane.observations = json.at("observations").get<std::int64_t>();
  plane.first_seen = Timestamp::from_seconds(json.at("first_seen").get<double>());
  plane.last_seen = Timestamp::from_seconds(json.at("last_seen").get<double>());
  if (json.contains("centroid")) plane.centroid_map = vector_of(json.at("centroid"));
  if (json.contains("unobserved_directions")) {
    plane.unobserved_directions = json.at("unobserved_directions").get<int>();
  }
  return plane;
}

}  // namespace

PlaneSigmas plane_sigmas(const MapPlane& plane) {
  return plane_sigmas(Eigen::Matrix3d(plane.covariance + plane.covariance_mounting));
}

PlaneSigmas plane_sigmas(const Eigen::Matrix3d& C) {
  const Eigen::Matrix2d tilt = C.topLeftCorner<2, 2>();
  const double mean = 0.5 * tilt.trace();
  const double spread = std::sqrt(std::max(0.0, mean * mean - tilt.determinant()));
  return {std::sqrt(std::max(0.0, C(2, 2))), std::sqrt(std::max(0.0, mean + spread))};
}

void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory) {
  write_atomically(file, [&](std::ostream& out) { trajectory.write_tum(out); });
}

void write_planes_json(const std::filesystem::path& file, const std::vector<MapPlane>& planes) {
  Json list = Json::array();
  for (const auto& plane : planes) list.push_back(to_json(plane));
  Json json;
  json["planes"] = std::move(list);
  write_atomically(file, json.dump(1) + "\n");
}

std::vector<MapPlane> read_planes_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw Error(file.string() + ": cannot be opened, expected planes.json of a map");
  std::vector<MapPlane> planes;
  try {
    const Json root = Json::parse(in);
    for (const auto& json : root.at("planes")) planes.push_back(plane_of(json));
  } catch (const Json::exception& error) {
    const std::string why = error.what();  // "[json.exception.NAME.NUMBER] words"
    throw Error(file.string() + ": found that " + why.substr(why.find("] ") + 2) +
                ", expected planes.json of a map");
  }
  return planes;
}

}  // namespace lamina::io
