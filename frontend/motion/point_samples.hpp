// Fewer points, and where they lie: what a search over a grid asks of a map or submap.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include <lamina/frontend/motion/scan_points.hpp>

namespace lamina {

inline std::vector<Eigen::Vector2d> positions(const std::vector<OrientedPoint>& points) {
  std::vector<Eigen::Vector2d> result;
  result.reserve(points.size());
  for (const OrientedPoint& p : points) result.push_back(p.point);
  return result;
}

/// At most `count` of the points, evenly spread; more where they lie metres apart.
inline std::vector<OrientedPoint> sample(std::vector<OrientedPoint> points, std::size_t count) {
  for (double cell = 0.1; points.size() > count && cell < 3; cell *= 1.4) {
    points = thinned(points, cell);
  }
  return points;
}

}  // namespace lamina
