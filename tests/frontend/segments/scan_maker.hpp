// Scans of walls drawn as segments of a plan, for tests and benchmarks: exact truth, seeded noise.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <lamina/models/scan_segment.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina::test {

struct Wall {
  Eigen::Vector2d a, b;
};

struct TrueLine {
  double rho = 0, theta = 0;
  int beams = 0;         ///< that hit it
  double length = 0;     ///< between the first and the last of them, m
  double incidence = 0;  ///< of the least oblique beam, rad
};

struct ScanMaker {
  int beams = 1081;
  double fov = 1.5 * M_PI;  ///< first to last beam, rad
  LidarNoise noise{0.01, 0.0, 0.0};
  double range_max = 30;
  bool descending = false;
  double turn = 0;         ///< rad that the scanner turns from the first beam to the last
  double sigma_per_m = 0;  ///< noise that grows with range, of which the scan's model says nothing

  LaserScan empty() const {
    LaserScan scan;
    scan.angle_increment = fov / (beams - 1) * (descending ? -1 : 1);
    scan.angle_min = descending ? fov / 2 : -fov / 2;
    scan.range_min = 0.02;
    scan.range_max = range_max;
    scan.lidar.noise = noise;
    scan.ranges.assign(static_cast<std::size_t>(beams), 0.0F);
    return scan;
  }

  /// Distance along the beam to a wall, infinity when it misses.
  static double hit(const Wall& wall, double angle) {
    const Eigen::Vector2d u(std::cos(angle), std::sin(angle)), d = wall.b - wall.a;
    const double det = u.x() * -d.y() + u.y() * d.x();
    if (std::abs(det) < 1e-12) return std::numeric_limits<double>::infinity();
    const double r = (wall.a.x() * -d.y() + wall.a.y() * d.x()) / det;
    const double t = (u.x() * wall.a.y() - u.y() * wall.a.x()) / det;
    return r > 0 && t >= 0 && t <= 1 ? r : std::numeric_limits<double>::infinity();
  }

  /// Walls in the scanner's frame. `hits` gets the wall of each beam (-1: none).
  LaserScan scan(const std::vector<Wall>& walls, std::mt19937& random,
                 std::vector<int>* hits = nullptr) const {
    LaserScan out = empty();
    std::normal_distribution<double> normal;
    if (hits) hits->assign(out.size(), -1);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double swept = turn * (static_cast<double>(i) / std::max(1, beams - 1) - 0.5);
      const double angle = out.angle(i) + swept + noise.angle_sigma * normal(random);
      double best = range_max;
      for (std::size_t w = 0; w < walls.size(); ++w) {
        const double r = hit(walls[w], angle);
        if (r >= best) continue;
        best = r;
        if (hits) (*hits)[i] = static_cast<int>(w);
      }
      const double sigma = noise.range_sigma + sigma_per_m * std::min(best, range_max);
      const double error = sigma * normal(random);
      if (best < range_max) out.ranges[i] = static_cast<float>(best + error);
    }
    return out;
  }

  /// What of each wall the beams saw.
  std::vector<TrueLine> truth(const std::vector<Wall>& walls, const std::vector<int>& hits) const {
    std::vector<TrueLine> lines(walls.size());
    const LaserScan geometry = empty();
    std::vector<Eigen::Vector2d> first(walls.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i] < 0) continue;
      const std::size_t w = static_cast<std::size_t>(hits[i]);
      TrueLine& line = lines[w];
      const double angle = geometry.angle(i), r = hit(walls[w], angle);
      if (!std::isfinite(r)) continue;
      const Eigen::Vector2d p(r * std::cos(angle), r * std::sin(angle));
      if (line.beams == 0) {
        const Eigen::Vector2d d = (walls[w].b - walls[w].a).normalized();
        Eigen::Vector2d n(-d.y(), d.x());
        if (n.dot(walls[w].a) < 0) n = -n;
        line.rho = n.dot(walls[w].a);
        line.theta = std::atan2(n.y(), n.x());
        line.incidence = M_PI;
        first[w] = p;
      }
      ++line.beams;
      line.length = std::max(line.length, (p - first[w]).norm());
      line.incidence =
          std::min(line.incidence, std::abs(std::remainder(angle - line.theta, 2 * M_PI)));
    }
    return lines;
  }
};

/// A star-shaped polygon about the scanner: corners at random ranges, at least `min_gap` apart in
/// bearing.
inline std::vector<Wall> random_polygon(std::mt19937& random, int corners, double near,
                                        double far) {
  std::uniform_real_distribution<double> unit;
  std::vector<Eigen::Vector2d> points;
  const double turn = 2 * M_PI * unit(random);
  for (int i = 0; i < corners; ++i) {
    const double angle = turn + 2 * M_PI * (i + 0.6 * (unit(random) - 0.5)) / corners;
    const double r = near + (far - near) * unit(random);
    points.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  std::vector<Wall> walls;
  for (std::size_t i = 0; i < points.size(); ++i) {
    walls.push_back({points[i], points[(i + 1) % points.size()]});
  }
  return walls;
}

/// A rectangular room, the scanner at (x, y) with heading yaw, in the scanner's frame.
inline std::vector<Wall> room(double width, double depth, double x, double y, double yaw) {
  const Eigen::Vector2d corners[4] = {{0, 0}, {width, 0}, {width, depth}, {0, depth}};
  const double c = std::cos(yaw), s = std::sin(yaw);
  std::vector<Wall> walls;
  const auto local = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2d d = p - Eigen::Vector2d(x, y);
    return Eigen::Vector2d(c * d.x() + s * d.y(), -s * d.x() + c * d.y());
  };
  for (int i = 0; i < 4; ++i) walls.push_back({local(corners[i]), local(corners[(i + 1) % 4])});
  return walls;
}

/// Recall and false lines of one scan against truth.
struct LineScore {
  int expected = 0, found = 0, detected = 0, false_lines = 0;
  std::vector<double> rho_errors, angle_errors, nees;
  /// Of lines whose beams hit one wall, to nine tenths. A line over two walls that meet at an angle
  /// no noise lets one see has an error against either that says nothing of its covariance.
  std::vector<double> nees_one_wall;
  void add(const LineScore& o) {
    expected += o.expected;
    found += o.found;
    detected += o.detected;
    false_lines += o.false_lines;
    rho_errors.insert(rho_errors.end(), o.rho_errors.begin(), o.rho_errors.end());
    angle_errors.insert(angle_errors.end(), o.angle_errors.begin(), o.angle_errors.end());
    nees.insert(nees.end(), o.nees.begin(), o.nees.end());
    nees_one_wall.insert(nees_one_wall.end(), o.nees_one_wall.begin(), o.nees_one_wall.end());
  }
  double recall() const { return expected == 0 ? 1 : double(found) / expected; }
};

/// The wall that most beams of a segment hit; -1 when most hit none. `share`: how many of all.
inline int majority_wall(const ScanSegment& segment, const std::vector<int>& hits,
                         std::size_t walls, double* share = nullptr) {
  std::vector<int> votes(walls + 1, 0);
  const int n = static_cast<int>(hits.size());
  const int span = (segment.last_beam - segment.first_beam + n) % n;
  for (int i = 0; i <= span; ++i) {
    ++votes[static_cast<std::size_t>(hits[static_cast<std::size_t>((segment.first_beam + i) % n)] +
                                     1)];
  }
  const auto most = std::max_element(votes.begin(), votes.end());
  if (share) *share = static_cast<double>(*most) / (span + 1);
  return static_cast<int>(most - votes.begin()) - 1;
}

/// A true line counts when at least `min_beams` beams hit it over `min_length`, not all of them
/// more oblique than 80 degrees. A detection belongs to the wall most of its beams hit; it finds
/// that wall when it is within 5 degrees of its direction, or 4 sigma of its own, and its middle is
/// within 0.05 m + 3 sigma of it; otherwise it is false. Errors are those of the longest piece.
inline LineScore score(const std::vector<ScanSegment>& segments, const std::vector<TrueLine>& truth,
                       const std::vector<int>& hits, double sigma, int min_beams = 12,
                       double min_length = 0.3) {
  LineScore out;
  out.detected = static_cast<int>(segments.size());
  std::vector<const ScanSegment*> best(truth.size(), nullptr);
  for (const ScanSegment& s : segments) {
    const int wall = majority_wall(s, hits, truth.size());
    bool fits = false;
    if (wall >= 0) {
      const TrueLine& line = truth[static_cast<std::size_t>(wall)];
      const Eigen::Vector2d n(std::cos(line.theta), std::sin(line.theta));
      const double offset = n.dot(0.5 * (s.start + s.end)) - line.rho;
      const double turn = std::abs(std::remainder(s.theta - line.theta, 2 * M_PI));
      fits = turn < std::max(5 * M_PI / 180, 4 * std::sqrt(s.covariance(1, 1))) &&
             std::abs(offset) < 0.05 + 3 * sigma;
      const ScanSegment*& held = best[static_cast<std::size_t>(wall)];
      if (fits && (!held || held->count < s.count)) held = &s;
    }
    out.false_lines += fits ? 0 : 1;
  }
  for (std::size_t w = 0; w < truth.size(); ++w) {
    const TrueLine& line = truth[w];
    if (line.beams < min_beams || line.length < min_length || line.incidence > 80 * M_PI / 180) {
      continue;
    }
    ++out.expected;
    if (!best[w]) continue;
    ++out.found;
    const ScanSegment& s = *best[w];
    const Eigen::Vector2d e(s.rho - line.rho, std::remainder(s.theta - line.theta, 2 * M_PI));
    const Eigen::Matrix2d& C = s.covariance;
    const double det = C(0, 0) * C(1, 1) - C(0, 1) * C(1, 0);
    out.rho_errors.push_back(std::abs(e(0)));
    out.angle_errors.push_back(std::abs(e(1)));
    out.nees.push_back((C(1, 1) * e(0) * e(0) - 2 * C(0, 1) * e(0) * e(1) + C(0, 0) * e(1) * e(1)) /
                       det);
    double share = 0;
    majority_wall(s, hits, truth.size(), &share);
    if (share >= 0.9) out.nees_one_wall.push_back(out.nees.back());
  }
  return out;
}

}  // namespace lamina::test
