// Labels by tilt, height and what the robot stood on.
#include <lamina/backend/mapper/plane_labels.hpp>

#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
// The dominant floor replaces z as "level" only when it is nearly so: a map on a ramp keeps z.
constexpr double kLevelFloor = 5 * kDegree;

double tilt_from(const Eigen::Vector3d& up, const Eigen::Vector3d& normal) {
  return std::atan2(up.cross(normal).norm(), up.dot(normal));
}

double tilt_sigma(const MapPlane& plane) {
  const double variance = plane.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff();
  return std::sqrt(std::clamp(variance, 0.0, 1.0));
}

// How near the path comes to the plane.
double path_distance(const MapPlane& plane, const Trajectory& path) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& pose : path) {
    nearest = std::min(nearest, std::abs(plane.plane_map.signed_distance(pose.pose.translation())));
  }
  return nearest;
}

struct Floor {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const MapPlane* plane = nullptr;
  double reach = 0;  // m, a floor lies at most this far from the path
  double area = 0;   // m^2 of its level
};

Floor dominant_floor(const std::vector<MapPlane>& planes, const Trajectory& path,
                     const LabelOptions& options, double reach) {
  Floor floor;
  floor.reach = reach;
  for (const auto& plane : planes) {
    if (tilt_from(Eigen::Vector3d::UnitZ(), plane.plane_map.normal()) > 2 * kLevelFloor) continue;
    if (!path.empty() && path_distance(plane, path) > reach) continue;
    double area = 0;
    for (const auto& other : planes) {
      const bool same =
          tilt_from(plane.plane_map.normal(), other.plane_map.normal()) <
              options.level_tilt_deg * kDegree &&
          std::abs(plane.plane_map.signed_distance(other.centroid_map)) <= options.same_level_m;
      if (same) area += other.area;
    }
    // The level's largest plane stands for it.
    area += 1e-3 * plane.area;
    if (area > floor.area) {
      floor.area = area;
      floor.plane = &plane;
    }
  }
  if (floor.plane &&
      tilt_from(Eigen::Vector3d::UnitZ(), floor.plane->plane_map.normal()) <= kLevelFloor) {
    floor.up = floor.plane->plane_map.normal();
  }
  return floor;
}

PlaneLabel label_of(const MapPlane& plane, const Floor& floor, const Trajectory& path,
                    const LabelOptions& options) {
  const double tilt = tilt_from(floor.up, plane.plane_map.normal());
  const double margin = 3 * tilt_sigma(plane);
  if (std::abs(tilt - M_PI / 2) <= options.wall_tilt_deg * kDegree) return PlaneLabel::kWall;
  if (M_PI - tilt <= options.ceiling_tilt_deg * kDegree) return PlaneLabel::kCeiling;
  if (tilt <= std::max(options.level_tilt_deg * kDegree, std::min(margin, kLevelFloor))) {
    if (!floor.plane) return PlaneLabel::kOther;
    const double off = floor.plane->plane_map.signed_distance(plane.centroid_map);
    if (&plane == floor.plane || std::abs(off) <= options.same_level_m) return PlaneLabel::kFloor;
    if (plane.area >= options.floor_area_m2 && !path.empty() &&
        std::abs(off) > options.max_step_m && path_distance(plane, path) <= floor.reach) {
      return PlaneLabel::kFloor;
    }
    return std::abs(off) <= options.max_step_m ? PlaneLabel::kStep : PlaneLabel::kOther;
  }
  return tilt <= options.max_ramp_deg * kDegree ? PlaneLabel::kRamp : PlaneLabel::kOther;
}

}  // namespace

std::vector<std::string> LabelOptions::problems() const {
  std::vector<std::string> result;
  const auto angle = [&result](double value, const char* name) {
    if (!(value > 0 && value < 90)) {
      result.push_back(std::string(name) + ": expected more than 0 and less than 90");
    }
  };
  angle(level_tilt_deg, "labels.level_tilt_deg");
  angle(max_ramp_deg, "labels.max_ramp_deg");
  angle(wall_tilt_deg, "labels.wall_tilt_deg");
  angle(ceiling_tilt_deg, "labels.ceiling_tilt_deg");
  if (!(same_level_m > 0)) result.emplace_back("labels.same_level_m: expected more than 0");
  if (!(max_step_m > same_level_m)) {
    result.emplace_back("labels.max_step_m: expected more than labels.same_level_m");
  }
  return result;
}

void label_planes(std::vector<MapPlane>& planes, const Trajectory& path,
                  const LabelOptions& options) {
  Floor floor = dominant_floor(planes, path, options, options.body_height_m);
  // Shelves at a carried camera's own height are no floor: what it is carried over is larger.
  constexpr double kMuchLarger = 4;
  const Floor below = dominant_floor(planes, path, options, options.carried_height_m);
  if (below.area > kMuchLarger * floor.area) floor = below;
  std::vector<PlaneLabel> labels;
  for (const auto& plane : planes) labels.push_back(label_of(plane, floor, path, options));
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i].label = labels[i];
}

}  // namespace lamina
