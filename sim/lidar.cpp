// Scans by cutting faces with the scan plane, and their noise.
#include <lamina/sim/lidar.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <lamina/sim/random.hpp>

namespace lamina::sim {
namespace {
constexpr double kPi = 3.14159265358979323846;
constexpr std::uint64_t kScanStreams = 0x5CA0000000000000ULL;

// Where a face's outline crosses z = 0 of the scanner; nullopt: nowhere.
std::optional<std::array<Eigen::Vector2d, 2>> outline_crossings(const Face& face,
                                                                const SE3& T_lidar_map) {
  std::array<Eigen::Vector2d, 2> ends;
  std::size_t found = 0;
  const std::size_t count = face.corners_map.size();
  Eigen::Vector3d a = T_lidar_map * face.corners_map[count - 1];
  for (std::size_t i = 0; i < count && found < 2; ++i) {
    const Eigen::Vector3d b = T_lidar_map * face.corners_map[i];
    if ((a.z() < 0) != (b.z() < 0)) {
      ends[found++] = (a + a.z() / (a.z() - b.z()) * (b - a)).head<2>();
    }
    a = b;
  }
  if (found < 2) return std::nullopt;
  return ends;
}

// What a beam at an edge returns: something between its surface and its neighbour's.
double mixed_range(const ScanTruth& truth, std::size_t i, const LidarEffects& effects, double mix,
                   double share) {
  const std::size_t other = mix < 0.5 ? i - 1 : i + 1;  // wraps to past the end at i = 0
  const bool mixed = effects.mixed && other < truth.ranges.size() && truth.surfaces[other] >= 0 &&
                     std::abs(truth.ranges[i] - truth.ranges[other]) > effects.mixed_jump &&
                     std::abs(2 * mix - 1) < effects.mixed_probability;
  return mixed ? truth.ranges[i] + share * (truth.ranges[other] - truth.ranges[i])
               : truth.ranges[i];
}
}  // namespace

LidarEffects LidarEffects::none() {
  LidarEffects effects;
  effects.noise = effects.grazing = effects.mixed = false;
  effects.dropout = 0;
  return effects;
}

LidarSimulator::LidarSimulator(const Caster& caster, const LidarModel& model,
                               const LidarGeometry& geometry, const LidarEffects& effects,
                               std::uint64_t seed)
    : caster_(&caster), model_(model), geometry_(geometry), effects_(effects), seed_(seed) {
  for (int i = 0; i < geometry.beams; ++i) {
    const double angle = geometry.angle_min + i * geometry.angle_increment;
    directions_.emplace_back(std::cos(angle), std::sin(angle));
  }
}

void LidarSimulator::cut_face(const Face& face, std::int32_t surface, const SE3& T_lidar_map,
                              ScanTruth& out) const {
  const auto ends = outline_crossings(face, T_lidar_map);
  const Plane plane_lidar = T_lidar_map * face.plane_map;
  if (!ends || std::abs(plane_lidar.rho()) < 1e-9) {
    return;
  }
  const double start = std::atan2((*ends)[0].y(), (*ends)[0].x());
  const double stop = std::atan2((*ends)[1].y(), (*ends)[1].x());
  const double turn = std::remainder(stop - start, 2 * kPi);
  const double low = turn >= 0 ? start : stop, width = std::abs(turn);
  const Eigen::Vector2d n = plane_lidar.normal().head<2>();
  for (int lap = -2; lap <= 2; ++lap) {
    double first = (low + 2 * kPi * lap - geometry_.angle_min) / geometry_.angle_increment;
    double last = first + width / geometry_.angle_increment;
    if (first > last) {
      std::swap(first, last);
    }
    first = std::max(0.0, std::ceil(first - 1e-9));
    last = std::min(geometry_.beams - 1.0, std::floor(last + 1e-9));
    for (double beam = first; beam <= last; ++beam) {
      const std::size_t i = static_cast<std::size_t>(beam);
      const double range = plane_lidar.rho() / n.dot(directions_[i]);
      if (range > 0 && range < out.ranges[i]) {
        out.ranges[i] = range;
        out.surfaces[i] = surface;
      }
    }
  }
}

void LidarSimulator::cast_rest(const SE3& T_map_lidar, ScanTruth& out) const {
  const Scene& scene = caster_->scene();
  if (scene.cylinders().empty() && !caster_->has_meshes()) {
    return;
  }
  for (std::size_t i = 0; i < directions_.size(); ++i) {
    const Eigen::Vector3d direction =
        T_map_lidar.so3() * Eigen::Vector3d(directions_[i].x(), directions_[i].y(), 0);
    std::int32_t surface = static_cast<std::int32_t>(scene.faces().size());
    for (const Cylinder& cylinder : scene.cylinders()) {
      const auto range = cast_cylinder(cylinder, T_map_lidar.translation(), direction, 1e-6);
      if (range && *range < out.ranges[i]) {
        out.ranges[i] = *range;
        out.surfaces[i] = surface;
      }
      ++surface;
    }
    if (const auto hit =
            caster_->cast_meshes(T_map_lidar.translation(), direction, 1e-6, out.ranges[i])) {
      out.ranges[i] = hit->range;
      out.surfaces[i] = hit->surface;
    }
  }
}

ScanTruth LidarSimulator::truth(const SE3& T_map_lidar) const {
  ScanTruth out;
  out.ranges.assign(directions_.size(), geometry_.range_max);
  out.surfaces.assign(directions_.size(), -1);
  const SE3 T_lidar_map = T_map_lidar.inverse();
  std::int32_t surface = 0;
  for (const Face& face : caster_->scene().faces()) {
    cut_face(face, surface++, T_lidar_map, out);
  }
  cast_rest(T_map_lidar, out);
  for (std::size_t i = 0; i < out.ranges.size(); ++i) {
    if (out.surfaces[i] < 0 || out.ranges[i] < geometry_.range_min) {
      out.ranges[i] = 0;
      out.surfaces[i] = -1;
    }
  }
  return out;
}

ScanTruth LidarSimulator::truth(const std::vector<SE3>& T_map_lidar) const {
  ScanTruth out;
  const std::size_t beams = directions_.size(), pieces = T_map_lidar.size();
  for (std::size_t k = 0; k < pieces; ++k) {
    const ScanTruth all = truth(T_map_lidar[k]);
    for (std::size_t i = k * beams / pieces; i < (k + 1) * beams / pieces; ++i) {
      out.ranges.push_back(all.ranges[i]);
      out.surfaces.push_back(all.surfaces[i]);
    }
  }
  return out;
}

LaserScan LidarSimulator::measure(const ScanTruth& truth, const SE3& T_map_lidar, Timestamp stamp,
                                  std::uint64_t scan_index) const {
  LaserScan scan;
  scan.stamp = stamp;
  scan.angle_min = geometry_.angle_min;
  scan.angle_increment = geometry_.angle_increment;
  scan.range_min = geometry_.range_min;
  scan.range_max = geometry_.range_max;
  scan.lidar = model_;
  const std::size_t count = truth.ranges.size();
  const double cos_limit = std::cos(effects_.grazing_deg * kPi / 180);
  const auto& faces = caster_->scene().faces();
  Random random(seed_, kScanStreams + scan_index);
  std::vector<double> ranges = truth.ranges;
  for (std::size_t i = 0; i < count; ++i) {
    // Every beam draws the same numbers whatever is switched on, so that switches do not reshuffle.
    const double drop = random.uniform(), noise = random.normal();
    const double mix = random.uniform(), share = random.uniform();
    if (truth.surfaces[i] < 0) {
      continue;
    }
    const std::size_t s = static_cast<std::size_t>(truth.surfaces[i]);
    const Eigen::Vector3d direction(directions_[i].x(), directions_[i].y(), 0);
    const double cosine =
        s < faces.size() ? std::abs(faces[s].plane_map.normal().dot(T_map_lidar.so3() * direction))
                         : 1;
    ranges[i] = mixed_range(truth, i, effects_, mix, share);
    ranges[i] += effects_.noise ? noise * model_.noise.range_sigma : 0;
    if (drop < effects_.dropout || (effects_.grazing && cosine < cos_limit) ||
        ranges[i] < geometry_.range_min || ranges[i] > geometry_.range_max) {
      ranges[i] = 0;
    }
  }
  scan.ranges.reserve(count);
  for (double range : ranges) {
    scan.ranges.push_back(static_cast<float>(range));
  }
  return scan;
}

}  // namespace lamina::sim
