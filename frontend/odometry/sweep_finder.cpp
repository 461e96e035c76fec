// Costs of pairs over sweeps: a coarse search, then parabolas.
#include <lamina/frontend/odometry/sweep_finder.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <lamina/frontend/odometry/line_matcher.hpp>
#include <lamina/frontend/odometry/sweep.hpp>

namespace lamina {
namespace {

constexpr double kApart = 0.5, kTurned = 0.6;  // m, rad: scans further apart see other things
constexpr double kRates = 0.25;                // rad/s that two scans' turn rates differ by
constexpr double kNext = 0.1;                  // rad or m between pairs
constexpr double kFit = 0.05;                  // m; further off is no fit, however far
constexpr double kLongest = 0.2;               // s: slower scanners are not built
constexpr std::size_t kLeastPairs = 20, kGroups = 10, kShots = 60;
constexpr double kGain = 0.1, kSigmas = 4;

std::vector<OrientedPoint> points_of(const LaserScan& scan, double sweep,
                                     const Vector6d& velocity) {
  const double beams = static_cast<double>(std::max<std::size_t>(scan.size(), 2) - 1);
  return thinned(oriented_points(straightened(scan, sweep / beams, velocity)), 0.05);
}

double sum(const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); }

// Where the parabola through three equally spaced costs is least, in steps from the middle.
double least(double before, double middle, double after) {
  const double bend = before - 2 * middle + after;
  return bend > 0 ? std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) : 0;
}

// What each group of pairs sums up to, in the order they were seen.
std::vector<double> grouped(const std::vector<double>& costs) {
  std::vector<double> groups(kGroups, 0);
  for (std::size_t i = 0; i < costs.size(); ++i) groups[i * kGroups / costs.size()] += costs[i];
  return groups;
}

}  // namespace

void SweepFinder::add(const LaserScan& scan, const PlanarPose& T_start_body,
                      const Vector6d& velocity) {
  if (!wants_more() || scan.time_increment > 0 || scan.size() < 2) return;
  if (last_stamp_ && scan.stamp > *last_stamp_) {
    const double dt = scan.stamp - *last_stamp_;
    interval_ = interval_ > 0 ? std::min(interval_, dt) : dt;
  }
  last_stamp_ = scan.stamp;
  std::erase_if(near_, [&](const Shot& shot) {
    return (shot.T_start_body.translation() - T_start_body.translation()).norm() > kApart;
  });
  const Shot now{scan, T_start_body, velocity};
  const auto far = [&](const PlanarPose& a) {
    const PlanarPose moved = a.inverse() * T_start_body;
    return moved.translation().norm() > kNext || std::abs(moved.yaw) > kNext;
  };
  if (!last_pair_ || far(*last_pair_)) {
    const Shot* best = nullptr;
    double most = kRates;
    for (const Shot& shot : near_) {
      if (std::abs((shot.T_start_body.inverse() * T_start_body).yaw) > kTurned) continue;
      const double rates = std::abs(shot.turn_rate() - now.turn_rate());
      if (rates <= most) continue;
      most = rates;
      best = &shot;
    }
    if (best) {
      const bool turning = std::abs(now.turn_rate()) > std::abs(best->turn_rate());
      pairs_.push_back(turning ? Pair{*best, now} : Pair{now, *best});
      last_pair_ = T_start_body;
    }
  }
  // Of a robot that stands, one scan is enough.
  const bool again = !near_.empty() && !far(near_.back().T_start_body) &&
                     std::abs(near_.back().turn_rate() - now.turn_rate()) < kRates;
  if (again) return;
  if (near_.size() >= kShots) near_.erase(near_.begin());
  near_.push_back(now);
}

// Mean square of what points are off, truncated.
double SweepFinder::cost(const Pair& pair, double sweep) const {
  const PointMap map(points_of(pair.still.scan, sweep, pair.still.velocity));
  const auto points = points_of(pair.turning.scan, sweep, pair.turning.velocity);
  const PlanarPose start = pair.still.T_start_body.inverse() * pair.turning.T_start_body;
  const LineMatch match = match_lines(map, points, start);
  const double fit = std::min(match.rms, kFit);
  return match.matched * fit * fit + (1 - match.matched) * kFit * kFit;
}

std::vector<double> SweepFinder::costs(double sweep) const {
  std::vector<double> all;
  for (const Pair& pair : pairs_) all.push_back(cost(pair, sweep));
  return all;
}

std::optional<SweepFinder::Found> SweepFinder::found() const {
  if (pairs_.size() < kLeastPairs) return std::nullopt;
  // A beam is back where it began before the next scan.
  const double longest = std::min(interval_, kLongest);
  const std::vector<double> still = costs(0);
  double best = 0, least_cost = sum(still), step = 0;
  for (const double share : {-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0}) {
    const double c = sum(costs(share * longest));
    if (c < least_cost) {
      least_cost = c;
      best = share * longest;
    }
  }
  if (!(least_cost < (1 - kGain / 2) * sum(still))) return std::nullopt;
  std::vector<double> before, middle, after;
  for (const double share : {0.25, 0.125}) {
    step = share * longest;
    before = costs(best - step);
    middle = costs(best);
    after = costs(best + step);
    best += step * least(sum(before), sum(middle), sum(after));
  }
  const double centre = best;
  before = grouped(costs(centre - step));
  middle = grouped(costs(centre));
  after = grouped(costs(centre + step));
  const std::vector<double> at_zero = grouped(still);
  const double all_before = sum(before), all_middle = sum(middle), all_after = sum(after);
  Found result{centre + step * least(all_before, all_middle, all_after), 0};
  double squares = 0, gain_squares = 0;
  const double n = static_cast<double>(kGroups);
  const double gain = sum(at_zero) - all_middle;
  for (std::size_t g = 0; g < kGroups; ++g) {
    const double without =
        centre + step * least(all_before - before[g], all_middle - middle[g], all_after - after[g]);
    squares += (without - result.sweep) * (without - result.sweep);
    gain_squares += std::pow(at_zero[g] - middle[g] - gain / n, 2);
  }
  result.sigma = std::sqrt((n - 1) / n * squares);
  const double gain_sigma = std::sqrt(gain_squares * n / (n - 1));
  if (!(gain > kGain * sum(at_zero)) || !(gain > kSigmas * gain_sigma)) return std::nullopt;
  return result;
}

}  // namespace lamina
