// Planes to lines in plan.
#include <lamina/backend/merging/wall_map.hpp>

#include <algorithm>
#include <cmath>
#include <map>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kWallTilt = 25 * kDegree;
constexpr double kHash = 0.5;          // m
constexpr double kMinArea = 0.05;      // m^2: less is an edge or noise; lines count as 0.5 m high
constexpr double kUnknownSigma = 0.1;  // m, where a plane has no covariance

std::int64_t hash(double x) { return to_far_cell(x / kHash); }

}  // namespace

Eigen::Matrix2d PlanPose::R() const {
  Eigen::Matrix2d result;
  result << std::cos(yaw), -std::sin(yaw), std::sin(yaw), std::cos(yaw);
  return result;
}

PlanWalls::PlanWalls(const MapState& map, const FreeSpace& free) : free_(free) {
  for (const PlaneLandmark& plane : map.graph.planes) {
    if (plane.active && !plane.outline.empty()) add(plane);
  }
  find_lines();
  low_.setConstant(1e9);
  high_.setConstant(-1e9);
  for (std::size_t w = 0; w < walls_.size(); ++w) {
    for (std::size_t k = 0; k < walls_[w].points.size(); ++k) {
      const Eigen::Vector2d& p = walls_[w].points[k];
      cells_[key(hash(p.x()), hash(p.y()))].push_back(
          {static_cast<std::uint32_t>(w), static_cast<std::uint32_t>(k)});
      low_ = low_.cwiseMin(p);
      high_ = high_.cwiseMax(p);
    }
  }
}

void PlanWalls::add(const PlaneLandmark& landmark) {
  const Plane plane = landmark.plane_map();
  if (std::abs(plane.normal().z()) > std::sin(kWallTilt)) return;
  PlanWall wall;
  wall.normal = plane.normal().head<2>().normalized();
  const Eigen::Vector2d along(-wall.normal.y(), wall.normal.x());
  struct Sum {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
  };
  std::map<std::int64_t, Sum> bins;
  wall.z_low = 1e9;
  wall.z_high = -1e9;
  const double side = landmark.outline.cell_size();
  for (const auto& [i, j] : landmark.outline.cells()) {
    const Eigen::Vector3d p =
        landmark.T_map_outline * Eigen::Vector3d(side * (i + 0.5), side * (j + 0.5), 0);
    Sum& bin = bins[to_far_cell(along.dot(p.head<2>()) / kStep)];
    bin.sum += p.head<2>();
    ++bin.count;
    wall.z_low = std::min(wall.z_low, p.z() - side / 2);
    wall.z_high = std::max(wall.z_high, p.z() + side / 2);
  }
  const double length = kStep * static_cast<double>(bins.size());
  if (std::max(landmark.outline.area(), 0.5 * length) < kMinArea) return;
  for (const auto& [bin, sum] : bins) wall.points.emplace_back(sum.sum / sum.count);
  wall.sigma_m =
      landmark.covariance ? std::sqrt(std::max(0.0, (*landmark.covariance)(2, 2))) : kUnknownSigma;
  walls_.push_back(std::move(wall));
}

// Walls that face one way and continue each other within 10 cm, the longest first.
void PlanWalls::find_lines() {
  std::stable_sort(walls_.begin(), walls_.end(), [](const PlanWall& x, const PlanWall& y) {
    return x.points.size() > y.points.size();
  });
  std::vector<const PlanWall*> first;
  for (PlanWall& wall : walls_) {
    const Eigen::Vector2d middle = wall.points[wall.points.size() / 2];
    std::size_t line = 0;
    for (; line < first.size(); ++line) {
      const PlanWall& f = *first[line];
      if (f.normal.dot(wall.normal) < std::cos(5 * kDegree)) continue;
      if (std::abs(f.normal.dot(middle - f.points[f.points.size() / 2])) < 0.1) break;
    }
    if (line == first.size()) first.push_back(&wall);
    wall.line = line;
  }
  lines_ = first.size();
}

template <class F>
void PlanWalls::near(const Eigen::Vector2d& x, double reach, const F& take) const {
  for (std::int64_t i = hash(x.x() - reach); i <= hash(x.x() + reach); ++i) {
    for (std::int64_t j = hash(x.y() - reach); j <= hash(x.y() + reach); ++j) {
      const auto cell = cells_.find(key(i, j));
      if (cell == cells_.end()) continue;
      for (const Mark& m : cell->second) take(walls_[m.wall], walls_[m.wall].points[m.point]);
    }
  }
}

PlanWalls::Nearest PlanWalls::nearest(const Eigen::Vector2d& x, const Eigen::Vector2d& normal,
                                      double gate, double angle) const {
  constexpr double kBeside = 0.2;  // m along the wall beyond what was seen of it
  Nearest best;
  near(x, gate + kBeside, [&](const PlanWall& wall, const Eigen::Vector2d& p) {
    if (wall.normal.dot(normal) < std::cos(angle)) return;
    const Eigen::Vector2d d = x - p;
    const double off = wall.normal.dot(d);
    if (std::abs(off) > gate || (d - off * wall.normal).norm() > kBeside) return;
    if (best.wall == nullptr || std::abs(off) < std::abs(best.off)) best = {&wall, off};
  });
  return best;
}

Spot PlanWalls::look(const Eigen::Vector2d& x, const Eigen::Vector2d& normal, double gate,
                     const PlanWall& wall) const {
  constexpr double kAngle = 6 * kDegree, kKnown = 0.3;
  if (nearest(x, normal, gate, kAngle).wall != nullptr) return Spot::kSame;
  if (wall.z_low < free_.height() + 0.1 && wall.z_high > free_.height() - 0.1 && free_.free(x)) {
    return Spot::kFree;
  }
  bool known = false;
  near(x, kKnown, [&](const PlanWall&, const Eigen::Vector2d& p) {
    known = known || (x - p).squaredNorm() < kKnown * kKnown;
  });
  return known ? Spot::kOther : Spot::kUnknown;
}

}  // namespace lamina
