// A scan as oriented points: what scan matching works on.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// A return and the direction of the surface there, seen from above: in the x-y plane of the body
/// (m). Vertical walls look the same from any tilt of the scanner once projected.
struct OrientedPoint {
  Eigen::Vector2d point;
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  ///< unit, towards the scanner; zero: unknown
  double sigma = 0.01;                               ///< m, of one return along the normal

  bool oriented() const { return normal.x() != 0 || normal.y() != 0; }
};

template <class A>
void fields(A& a, OrientedPoint& v) {
  a(v.point, v.normal, v.sigma);
}

struct ScanPointOptions {
  double max_range = 40;  ///< m; farther returns are sparse and grazing
  double radius = 0.15;   ///< m; a normal is fitted over neighbours this near (10 sigma or more)
  double max_gap = 0.4;   ///< m (+ 5 % of the range); a larger step between beams is an edge
  /// Beams to each side within `radius` (more where that is 10 sigma): bounds the work on dense
  /// scans.
  int max_neighbours = 20;
};

/// The valid returns of a scan in the body's x-y plane, with normals fitted to runs of neighbouring
/// beams; at corners the better one-sided run counts. Cost O(beams * max_neighbours).
std::vector<OrientedPoint> oriented_points(const LaserScan& scan,
                                           const ScanPointOptions& options = {});

/// Without the returns that stand alone: neither the one before nor the one after (in the order of
/// the beams) within `reach` m and 5 % of the range from `scanner`. Dust, rain, mixed edges and
/// faults of the sensor are nowhere twice: where walls are thinned to even density, they are what
/// adds up.
std::vector<OrientedPoint> without_lone(const std::vector<OrientedPoint>& points,
                                        const Eigen::Vector2d& scanner, double reach = 0.4);

/// The same points seen from frame a.
std::vector<OrientedPoint> transformed(const std::vector<OrientedPoint>& points,
                                       const PlanarPose& T_a_b);

/// One point per square cell of `cell` metres (the first of each, in order): even density.
std::vector<OrientedPoint> thinned(const std::vector<OrientedPoint>& points, double cell);

}  // namespace lamina
