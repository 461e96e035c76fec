// Fans of free sight, and how points vote against them.
#include <lamina/frontend/motion/submap.hpp>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kPi = 3.14159265358979323846;

int bin_of(double bearing) {
  return to_whole((bearing + kPi) / (2 * kPi) * SightFan::kBins, 0, SightFan::kBins - 1);
}

}  // namespace

SightFan sight_fan(const std::vector<OrientedPoint>& points_body, const Eigen::Vector2d& scanner,
                   const PlanarPose& T_anchor_body) {
  SightFan fan;
  fan.T_anchor_scanner = T_anchor_body * PlanarPose{scanner.x(), scanner.y(), 0};
  fan.nearest.assign(SightFan::kBins, 0.0F);
  for (const OrientedPoint& p : points_body) {
    const Eigen::Vector2d d = p.point - scanner;
    const auto range = static_cast<float>(d.norm());
    float& nearest = fan.nearest[static_cast<std::size_t>(bin_of(std::atan2(d.y(), d.x())))];
    if (nearest == 0 || range < nearest) nearest = range;
  }
  return fan;
}

FanAgreement agreement(const std::vector<SightFan>& fans_a,
                       const std::vector<OrientedPoint>& points_b, const PlanarPose& T_a_b,
                       double margin) {
  FanAgreement result;
  std::vector<PlanarPose> T_fan_b;
  for (const SightFan& fan : fans_a) T_fan_b.push_back(fan.T_anchor_scanner.inverse() * T_a_b);
  for (const OrientedPoint& p : points_b) {
    int vote = 0;
    double best_range = 1e9;
    for (std::size_t i = 0; i < fans_a.size(); ++i) {
      const Eigen::Vector2d q = T_fan_b[i] * p.point;
      const double range = q.norm();
      if (range >= best_range) continue;
      const float seen =
          fans_a[i].nearest[static_cast<std::size_t>(bin_of(std::atan2(q.y(), q.x())))];
      if (seen == 0) continue;
      const double slack = margin + 0.02 * range;
      if (range > static_cast<double>(seen) + slack) continue;  // hidden from there
      vote = range < static_cast<double>(seen) - slack ? -1 : 1;
      best_range = range;
    }
    result.agree += vote > 0;
    result.contradict += vote < 0;
  }
  return result;
}

}  // namespace lamina
