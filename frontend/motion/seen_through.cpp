// Votes of fans, and the matcher's cost.
#include <lamina/frontend/motion/seen_through.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

// The nearest that a fan saw in a bearing and beside it; 0: nothing in the bearing itself.
double seen_at(const SightFan& fan, double bearing) {
  constexpr int kBins = SightFan::kBins;
  if (!std::isfinite(bearing)) return 0;
  const int bin = static_cast<int>(std::floor((bearing + M_PI) / (2 * M_PI) * kBins));
  const auto at = [&](int i) {
    return static_cast<double>(fan.nearest[static_cast<std::size_t>((i + kBins) % kBins)]);
  };
  double nearest = at(bin);
  if (nearest == 0) return 0;
  for (const int i : {bin - 1, bin + 1}) {
    if (at(i) > 0) nearest = std::min(nearest, at(i));
  }
  return nearest;
}

// Cauchy's kernel with the matcher's scale.
double rho(double chi_squared) { return 4 * std::log1p(chi_squared / 4); }

}  // namespace

std::vector<bool> seen_through(const std::vector<OrientedPoint>& points,
                               const std::vector<SightFan>& fans, const PlanarPose& T_fans_points,
                               double margin) {
  constexpr int kEnough = 2;
  std::vector<PlanarPose> T_fan_points;
  for (const SightFan& fan : fans) {
    T_fan_points.push_back(fan.T_anchor_scanner.inverse() * T_fans_points);
  }
  std::vector<bool> through;
  for (const OrientedPoint& p : points) {
    int votes = 0;
    for (std::size_t i = 0; i < fans.size() && votes < kEnough; ++i) {
      const Eigen::Vector2d q = T_fan_points[i] * p.point;
      const double range = q.norm(), seen = seen_at(fans[i], std::atan2(q.y(), q.x()));
      votes += seen > 0 && range + margin + 0.02 * range < seen;
    }
    through.push_back(votes >= kEnough);
  }
  return through;
}

double looked_at(const std::vector<OrientedPoint>& points, const std::vector<SightFan>& fans,
                 const PlanarPose& T_fans_points) {
  if (points.empty()) return 0;
  std::size_t count = 0;
  for (const OrientedPoint& p : points) {
    const auto looks = [&](const SightFan& fan) {
      const Eigen::Vector2d q = fan.T_anchor_scanner.inverse() * (T_fans_points * p.point);
      return seen_at(fan, std::atan2(q.y(), q.x())) > 0;
    };
    count += std::any_of(fans.begin(), fans.end(), looks);
  }
  return static_cast<double>(count) / static_cast<double>(points.size());
}

std::vector<OrientedPoint> without(const std::vector<OrientedPoint>& points,
                                   const std::vector<bool>& came) {
  constexpr double kThing = 0.3;  // m
  std::vector<OrientedPoint> things, others;
  for (std::size_t i = 0; i < points.size(); ++i) (came[i] ? things : others).push_back(points[i]);
  std::erase_if(others, [&](const OrientedPoint& p) {
    return std::any_of(things.begin(), things.end(), [&](const OrientedPoint& c) {
      return (p.point - c.point).squaredNorm() < kThing * kThing;
    });
  });
  return others;
}

double match_cost(const PointMap& map, const std::vector<OrientedPoint>& scan, const PlanarPose& T,
                  const PlanarPrior& prior, const LineMatchOptions& stated) {
  constexpr double kFreedom = 3;
  double largest = 0;
  for (const OrientedPoint& p : scan) largest = std::max(largest, p.sigma);
  const LineMatchOptions options = stated.for_noise(largest);
  const Eigen::Matrix2d R = T.rotation();
  const OrientedPoint* neighbour = nullptr;
  double sum = 0;
  for (const OrientedPoint& p : scan) {
    if (!p.oriented()) continue;
    const OrientedPoint* q = map.nearest(T * p.point, R * p.normal, options.end_radius, neighbour);
    const double variance = p.sigma * p.sigma + (q ? q->sigma * q->sigma : p.sigma * p.sigma);
    const double e = q ? q->normal.dot(T * p.point - q->point) : options.end_radius;
    sum += rho(e * e / variance);
    if (q) neighbour = q;
  }
  const PlanarPose off = prior.T_map_scan.inverse() * T;
  const Eigen::Vector3d e(off.x, off.y, off.yaw);
  const double chi = e.dot(prior.information * e);
  const double by_prior = prior.robust ? kFreedom * rho(chi / kFreedom) : chi;
  return 0.5 * (sum / options.samples_per_fact + by_prior);
}

}  // namespace lamina
