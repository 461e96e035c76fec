// Costs of pairs over sweeps: a coarse search, then Gauss-Newton.
#include <lamina/frontend/motion/sweep_finder.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include <lamina/frontend/motion/deskew.hpp>
#include <lamina/frontend/motion/line_matcher.hpp>
#include <lamina/models/median.hpp>

namespace lamina {
namespace {

constexpr double kApart = 0.5, kTurned = 0.6;  // m, rad: scans further apart see other things
constexpr double kRates = 0.25;                // rad/s that two scans' turn rates differ by
constexpr double kNext = 0.1;                  // rad or m between pairs
constexpr double kFit = 0.05;                  // m; further off is no fit, however far
constexpr double kLongest = 0.2;               // s: slower scanners are not built
constexpr std::size_t kLeastPairs = 20, kShots = 60, kIntervals = 200;
constexpr std::int64_t kMostOfABlock = 20;  // pairs: those that are kept are of ten blocks at least
constexpr std::size_t kCoarsePairs = 50;    // tell which of the sweeps tried is nearest
constexpr int kRounds = 8;
constexpr double kSamplesPerFact = LineMatchOptions().samples_per_fact;
constexpr double kStep = 1e-4, kLeast = 0.01;  // s; shorter sweeps hardly matter

std::vector<OrientedPoint> points_of(const LaserScan& scan, double sweep,
                                     const Vector6d& velocity) {
  const double beams = static_cast<double>(std::max<std::size_t>(scan.size(), 2) - 1);
  return thinned(oriented_points(straightened(scan, sweep / beams, velocity)), 0.05);
}

// How a point in the body's plane moves with the sweep (m/s): its beam came that share of the sweep
// after the first.
Eigen::Vector2d by_sweep(const Eigen::Vector2d& p, const LaserScan& scan, const Vector6d& v) {
  const SE3& T_body_lidar = scan.lidar.T_body_lidar;
  const Eigen::Vector3d q =
      T_body_lidar.inverse() * Eigen::Vector3d(p.x(), p.y(), T_body_lidar.translation().z());
  const double all = scan.angle_increment * static_cast<double>(scan.size() - 1);
  const double middle = scan.angle_min + 0.5 * all;
  const double from_middle = std::remainder(std::atan2(q.y(), q.x()) - middle, 2 * M_PI);
  const double share = std::clamp(0.5 + from_middle / all, 0.0, 1.0);
  return share * Eigen::Vector2d(v(0) - v(5) * p.y(), v(1) + v(5) * p.x());
}

// Of one place and heading, the shot whose rate of turn is furthest from that of `now`; null: none
// differs.
template <class Shot>
const Shot* differently_turning(const std::vector<Shot>& near, const Shot& now) {
  const Shot* best = nullptr;
  double most = kRates;
  for (const Shot& shot : near) {
    if (std::abs((shot.T_start_body.inverse() * now.T_start_body).yaw) > kTurned) continue;
    const double rates = std::abs(shot.turn_rate() - now.turn_rate());
    if (rates <= most) continue;
    most = rates;
    best = &shot;
  }
  return best;
}

// Of all ways to draw signs for the gains of a few blocks, the share that sum up to no less.
double by_chance(const std::vector<double>& gains) {
  const unsigned ways = 1U << gains.size();
  const double reached = std::accumulate(gains.begin(), gains.end(), 0.0);
  unsigned as_much = 0;
  for (unsigned signs = 0; signs < ways; ++signs) {
    double sum = 0;
    for (std::size_t k = 0; k < gains.size(); ++k)
      sum += (signs >> k & 1) ? std::abs(gains[k]) : -std::abs(gains[k]);
    if (sum >= reached) ++as_much;
  }
  return static_cast<double>(as_much) / ways;
}

double block_of(Timestamp stamp) { return std::floor(stamp.seconds() / AdoptionOptions().block_s); }

}  // namespace

void SweepFinder::add(const LaserScan& scan, const PlanarPose& T_start_body,
                      const Vector6d& velocity, const Vector6d& acceleration) {
  if (!wants_more() || scan.time_increment > 0 || scan.size() < 2) return;
  if (last_stamp_ && scan.stamp > *last_stamp_) {
    if (intervals_.size() < kIntervals) intervals_.push_back(scan.stamp - *last_stamp_);
  }
  last_stamp_ = scan.stamp;
  std::erase_if(near_, [&](const Shot& shot) {
    return (shot.T_start_body.translation() - T_start_body.translation()).norm() > kApart;
  });
  const Shot now{scan, T_start_body, velocity, acceleration};
  const auto far = [&](const PlanarPose& a) {
    const PlanarPose moved = a.inverse() * T_start_body;
    return moved.translation().norm() > kNext || std::abs(moved.yaw) > kNext;
  };
  const auto same_block = [&scan](const Pair& pair) {
    return block_of(pair.turning.scan.stamp) == block_of(scan.stamp);
  };
  const bool room = std::count_if(pairs_.begin(), pairs_.end(), same_block) < kMostOfABlock;
  if (room && (!last_pair_ || far(*last_pair_))) {
    const Shot* best = differently_turning(near_, now);
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

struct SweepFinder::Laid {
  PointMap map;
  std::vector<OrientedPoint> points;
  LineMatch match;
  // The still scan's point that belongs to one of the turning scan's; nullptr where none is near.
  const OrientedPoint* partner(const OrientedPoint& p) const {
    if (!p.oriented()) return nullptr;
    const PlanarPose& T = match.T_map_scan;
    return map.nearest(T * p.point, T.rotation() * p.normal, LineMatchOptions().end_radius);
  }
  // What they are apart along the still one's normal.
  double apart(const OrientedPoint& p, const OrientedPoint& q) const {
    return q.normal.dot(match.T_map_scan * p.point - q.point);
  }
};

SweepFinder::Laid SweepFinder::lay(const Pair& pair, double sweep) {
  Laid laid{PointMap(points_of(pair.still.scan, sweep, pair.still.mean_velocity(sweep))),
            points_of(pair.turning.scan, sweep, pair.turning.mean_velocity(sweep)),
            {}};
  laid.match = match_lines(laid.map, laid.points,
                           pair.still.T_start_body.inverse() * pair.turning.T_start_body);
  return laid;
}

// Mean square of what points are off, truncated.
double SweepFinder::cost(const Pair& pair, double sweep) {
  const LineMatch match = lay(pair, sweep).match;
  const double fit = std::min(match.rms, kFit);
  return match.matched * fit * fit + (1 - match.matched) * kFit * kFit;
}

double SweepFinder::cost(double sweep, std::size_t every) const {
  double sum = 0;
  for (std::size_t i = 0; i < pairs_.size(); i += every) sum += cost(pairs_[i], sweep);
  return sum;
}

SweepFinder::Pull SweepFinder::pull(const Pair& pair, double sweep) {
  constexpr double kMatched = 0.5, kLoose = 0.3;  // m, rad: how far the pose may go beside it
  const Laid laid = lay(pair, sweep);
  if (!laid.match.converged || laid.match.matched < kMatched) return {};
  const Vector6d v_turning = pair.turning.mean_velocity(sweep);
  const Vector6d v_still = pair.still.mean_velocity(sweep);
  const Eigen::Matrix2d R = laid.match.T_map_scan.rotation();
  Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  H.diagonal().head<3>().setConstant(1 / (kLoose * kLoose));
  for (const OrientedPoint& p : laid.points) {
    const OrientedPoint* q = laid.partner(p);
    if (!q) continue;
    const Eigen::Vector2d n = R.transpose() * q->normal;
    const double e = laid.apart(p, *q);
    const double variance = p.sigma * p.sigma + q->sigma * q->sigma;
    const double weight = 1 / (variance * (1 + e * e / (4 * variance))) / kSamplesPerFact;
    const Eigen::Vector4d J(n.x(), n.y(), n.y() * p.point.x() - n.x() * p.point.y(),
                            n.dot(by_sweep(p.point, pair.turning.scan, v_turning)) -
                                q->normal.dot(by_sweep(q->point, pair.still.scan, v_still)));
    H += weight * J * J.transpose();
    b -= weight * e * J;
  }
  const Eigen::Vector3d shared = H.topLeftCorner<3, 3>().ldlt().solve(H.topRightCorner<3, 1>());
  return {H(3, 3) - shared.dot(H.topRightCorner<3, 1>()), b(3) - shared.dot(b.head<3>())};
}

double SweepFinder::coarse(double longest) const {
  const std::size_t every = std::max<std::size_t>(1, pairs_.size() / kCoarsePairs);
  double best = 0, least = cost(0, every);
  for (const double share : {-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0}) {
    const double c = cost(share * longest, every);
    if (c >= least) continue;
    least = c;
    best = share * longest;
  }
  return best;
}

std::vector<double> SweepFinder::misfits(const Laid& laid) {
  constexpr double kNone = 1000;
  std::vector<double> result;
  for (const OrientedPoint& p : laid.points) {
    if (!p.oriented()) continue;
    const OrientedPoint* q = laid.partner(p);
    result.push_back(q ? std::abs(laid.apart(p, *q)) / std::hypot(p.sigma, q->sigma) : kNone);
  }
  return result;
}

// `left_out`: the sweep by all blocks but one, for each of them.
Adoption SweepFinder::judge(double sweep, const std::vector<double>& left_out) const {
  constexpr double kMedian = 0.6745;  // of |normal| of variance 1
  std::vector<double> all;
  for (const Pair& pair : pairs_) {
    for (const double off : misfits(lay(pair, sweep))) all.push_back(off);
  }
  if (all.empty()) return {};
  const double noise = std::max(1e-3, median(std::move(all)) / kMedian);
  const auto squares = [noise](const Pair& pair, double at) {
    double sum = 0;
    for (const double off : misfits(lay(pair, at)))
      sum += std::min(kTruncated, off * off / (noise * noise));
    return sum / kSamplesPerFact;
  };
  std::vector<double> gains(left_out.size(), 0);
  Blocks blocks;
  for (const Pair& pair : pairs_) {
    const auto k = static_cast<std::size_t>(blocks.of(pair.turning.scan.stamp));
    gains[k] += squares(pair, 0) - squares(pair, left_out[k]);
  }
  // Fewer blocks do where chance would hardly gain as much: a robot may turn seldom, and pairs of
  // scans share no errors but within a turn.
  AdoptionOptions options;
  std::vector<double> clear;
  std::copy_if(gains.begin(), gains.end(), std::back_inserter(clear),
               [&](double gain) { return std::abs(gain) > options.least_gain; });
  const int half = options.least_blocks / 2;
  if (static_cast<int>(clear.size()) < options.least_blocks &&
      by_chance(clear) <= 1.0 / (1 << half))
    options.least_blocks = half;
  return lamina::judge(gains, options);
}

// Gauss-Newton; the sigma by leaving out one block after the other.
std::optional<SweepFinder::Found> SweepFinder::found() const {
  if (pairs_.size() < kLeastPairs || intervals_.empty()) return std::nullopt;
  // A beam is back where it began before the next scan; of stamps that jitter the middle says so.
  const double longest = std::min(median(intervals_), kLongest);
  Found result{coarse(longest), 0, {}};
  std::vector<double> left_out;
  for (int round = 0; round < kRounds; ++round) {
    Blocks blocks;
    std::vector<Pull> of_blocks;
    Pull all;
    for (const Pair& pair : pairs_) {
      const Pull one = pull(pair, result.sweep);
      const auto k = static_cast<std::size_t>(blocks.of(pair.turning.scan.stamp));
      if (k == of_blocks.size()) of_blocks.emplace_back();
      of_blocks[k] += one;
      all += one;
    }
    if (!(all.information > 0)) return std::nullopt;
    const double step = all.gradient / all.information;
    left_out.clear();
    for (const Pull& block : of_blocks) {
      const double left = all.information - block.information;
      const double without = left > 0 ? (all.gradient - block.gradient) / left : 0;
      left_out.push_back(std::clamp(result.sweep + without, -longest, longest));
    }
    result.sweep = std::clamp(result.sweep + step, -longest, longest);
    if (std::abs(step) < kStep) break;
  }
  result.sigma = jackknife_sigma(left_out);
  if (std::abs(result.sweep) < kLeast) return std::nullopt;
  result.adoption = judge(result.sweep, left_out);
  const double least = student_quantile(static_cast<double>(left_out.size()) - 1);
  if (std::abs(result.sweep) < least * result.sigma) result.adoption.adopted = false;
  return result;
}

}  // namespace lamina
