// Normals of scan points by line fits over runs of neighbouring beams.
#include <lamina/frontend/motion/scan_points.hpp>

#include <unordered_set>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

struct Run {
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
  double rms = 1e9;
};

/// Line through points [first, last]: direction of least scatter.
Run fit_run(const std::vector<Eigen::Vector2d>& p, std::size_t first, std::size_t last) {
  Run run;
  const double n = static_cast<double>(last - first + 1);
  if (n < 3) return run;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = first; i <= last; ++i) mean += p[i];
  mean /= n;
  double sxx = 0, sxy = 0, syy = 0;
  for (std::size_t i = first; i <= last; ++i) {
    const Eigen::Vector2d d = p[i] - mean;
    sxx += d.x() * d.x();
    sxy += d.x() * d.y();
    syy += d.y() * d.y();
  }
  const double half_difference = 0.5 * (sxx - syy), root = std::hypot(half_difference, sxy);
  const double small = std::max(0.0, 0.5 * (sxx + syy) - root), large = 0.5 * (sxx + syy) + root;
  if (large <= 0 || small > 0.1 * large) return run;
  const double angle = 0.5 * std::atan2(2 * sxy, sxx - syy);
  run.normal = {-std::sin(angle), std::cos(angle)};
  run.rms = std::sqrt(small / (n - 2));
  return run;
}

/// The same about point i; at a corner, where it misses the points by more than `rms`, that of the
/// better side.
Run fit_run_about(const std::vector<Eigen::Vector2d>& p, std::size_t first, std::size_t i,
                  std::size_t last, double rms) {
  const Run whole = fit_run(p, first, last);
  if (!(whole.rms > rms)) return whole;
  const Run before = fit_run(p, first, i), after = fit_run(p, i, last);
  const Run& better = before.rms < after.rms ? before : after;
  return better.rms < whole.rms ? better : whole;
}

}  // namespace

std::vector<OrientedPoint> oriented_points(const LaserScan& scan, const ScanPointOptions& options) {
  const double sigma = std::max(scan.lidar.noise.range_sigma, 1e-4);
  std::vector<Eigen::Vector2d> p;
  std::vector<std::size_t> beam;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!scan.valid(i) || static_cast<double>(scan.ranges[i]) > options.max_range) continue;
    const Eigen::Vector2d q = scan.point(i);
    p.push_back((scan.lidar.T_body_lidar * Eigen::Vector3d(q.x(), q.y(), 0)).head<2>());
    beam.push_back(i);
  }
  std::vector<OrientedPoint> result(p.size());
  const Eigen::Vector2d scanner = scan.lidar.T_body_lidar.translation().head<2>();
  const double radius = std::max(options.radius, 10 * sigma);
  // A beam away is a neighbour at the least, a scan at the most.
  const int most = to_whole(options.max_neighbours * radius / options.radius, 1, 1 << 20);
  const auto linked = [&](std::size_t a, std::size_t b) {
    return beam[b] - beam[a] <= 2 &&
           (p[a] - p[b]).norm() < options.max_gap + 0.05 * (p[a] - scanner).norm();
  };
  for (std::size_t i = 0; i < p.size(); ++i) {
    std::size_t first = i, last = i;
    for (int k = 0; k < most && first > 0 && linked(first - 1, first); ++k) {
      if (k >= 2 && (p[first - 1] - p[i]).norm() > radius) break;
      --first;
    }
    for (int k = 0; k < most && last + 1 < p.size() && linked(last, last + 1); ++k) {
      if (k >= 2 && (p[last + 1] - p[i]).norm() > radius) break;
      ++last;
    }
    const Run run = fit_run_about(p, first, i, last, 2 * sigma);
    result[i].point = p[i];
    result[i].sigma = sigma;
    if (run.rms < 3 * sigma + 0.01) {
      const double sign = run.normal.dot(p[i] - scanner) > 0 ? -1.0 : 1.0;
      result[i].normal = sign * run.normal;
    }
  }
  return result;
}

std::vector<OrientedPoint> without_lone(const std::vector<OrientedPoint>& points,
                                        const Eigen::Vector2d& scanner, double reach) {
  const auto near = [&](std::size_t a, std::size_t b) {
    return (points[a].point - points[b].point).norm() <
           reach + 0.05 * (points[a].point - scanner).norm();
  };
  std::vector<OrientedPoint> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if ((i > 0 && near(i, i - 1)) || (i + 1 < points.size() && near(i, i + 1))) {
      result.push_back(points[i]);
    }
  }
  return result;
}

std::vector<OrientedPoint> transformed(const std::vector<OrientedPoint>& points,
                                       const PlanarPose& T_a_b) {
  const Eigen::Matrix2d R = T_a_b.rotation();
  const Eigen::Vector2d t = T_a_b.translation();
  std::vector<OrientedPoint> result = points;
  for (OrientedPoint& p : result) {
    p.point = R * p.point + t;
    p.normal = R * p.normal;
  }
  return result;
}

std::vector<OrientedPoint> thinned(const std::vector<OrientedPoint>& points, double cell) {
  std::unordered_set<std::int64_t> taken;
  std::vector<OrientedPoint> result;
  for (const OrientedPoint& p : points) {
    const auto ix = std::int64_t{to_cell(p.point.x() / cell)};
    const auto iy = std::int64_t{to_cell(p.point.y() / cell)};
    if (taken.insert(ix * 2000003 + iy).second) result.push_back(p);
  }
  return result;
}

}  // namespace lamina
