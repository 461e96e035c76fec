// Pairs matched by scans alone; hypotheses scored against the wheels.
#include <lamina/pipeline/calibration/scanner_check.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/motion/likelihood_grid.hpp>
#include <lamina/frontend/motion/line_matcher.hpp>
#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/own_returns.hpp>

namespace lamina {
namespace {

constexpr double kThin = 0.03, kCell = 0.05;  // m: points of a match, cells of a search
constexpr int kLevels = 5;
constexpr double kFit = 0.05;  // m: further off is no fit, however far

std::vector<OrientedPoint> points_of(LaserScan scan, const ScanCorrection& correction) {
  constexpr double kMostRange = 20;  // m: what is further off is sparse, and makes searches slow
  correction.apply(scan);
  ScanPointOptions options;
  options.max_range = kMostRange;
  return thinned(oriented_points(scan, options), kThin);
}

template <class Pairs>
double total_misfit(const Pairs& pairs) {
  double sum = 0;
  for (const auto& pair : pairs) sum += pair.misfit;
  return sum;
}

// The scanner's place and heading across the floor.
PlanarPose seat(const SE3& T_body_lidar) {
  const Eigen::Vector3d ahead = T_body_lidar.so3() * Eigen::Vector3d::UnitX();
  return {T_body_lidar.translation().x(), T_body_lidar.translation().y(),
          std::atan2(ahead.y(), ahead.x())};
}

PlanarPose turned(PlanarPose seat, double yaw) {
  seat.yaw = wrap_angle(seat.yaw + yaw);
  return seat;
}

PlanarPose mirror_image(const PlanarPose& motion) { return {motion.x, -motion.y, -motion.yaw}; }

PlanarPose seen_from(const PlanarPose& seat, const PlanarPose& motion) {
  return seat.inverse() * motion * seat;
}

LineMatch searched(const PointMap& map, const std::vector<OrientedPoint>& points,
                   const ScannerCheckOptions& options) {
  std::vector<Eigen::Vector2d> there, here;
  for (const OrientedPoint& p : map.points()) there.push_back(p.point);
  for (const OrientedPoint& p : thinned(points, 2 * kCell)) here.push_back(p.point);
  SearchWindow window;
  window.translation = options.search_way;
  window.rotation = options.search_turn;
  const auto found =
      search_correlative(LikelihoodGrid(there, kCell, kCell, kLevels), here, {}, window, 0.3);
  if (!found) return {};
  LineMatchOptions fine;
  fine.start_radius = 6 * kCell;
  return match_lines(map, points, found->T_map_scan, {}, fine);
}

}  // namespace

void ScannerCheck::add(const LaserScan& scan, const std::optional<SE3>& wheels) {
  const bool same =
      from_ && (from_->lidar.T_body_lidar.inverse() * scan.lidar.T_body_lidar).log().norm() < 1e-9;
  if (from_ && !same) several_ = true;
  if (same && wheels) {
    since_ = since_ * *wheels;
    turned_ += std::abs(wheels->so3().yaw());
    way_ += wheels->translation().norm();
    if (turned_ < options_.pair_turn && way_ < options_.pair_way) return;
    const PlanarPose moved = planar_part(since_);
    const bool turns = std::abs(moved.yaw) >= options_.turning;
    const bool travels = moved.translation().norm() >= options_.travelling;
    if (turned_ <= options_.most_turn && way_ <= options_.most_way)
      keep({*from_, scan, moved}, turns, travels);
  }
  from_ = scan;
  since_ = SE3();
  turned_ = way_ = 0;
}

void ScannerCheck::keep(const Pair& pair, bool turns, bool travels) {
  if ((turns && turning_ < options_.most_pairs) || (travels && travelling_ < options_.most_pairs)) {
    pairs_.push_back(pair);
    turning_ += turns;
    travelling_ += travels;
    return;
  }
  if (!turns || passed_++ % every_ != 0) return;
  later_.push_back(pair);
  if (later_.size() <= options_.most_pairs) return;
  every_ *= 2;
  for (std::size_t i = 0; 2 * i < later_.size(); ++i) later_[i] = later_[2 * i];
  later_.resize((later_.size() + 1) / 2);
}

bool ScannerCheck::wants_more() const { return !several_; }

std::vector<ScannerCheck::Matched> ScannerCheck::match_all(const Pairs& pairs,
                                                           const ScanCorrection& correction) const {
  std::vector<Matched> all;
  for (const Pair& pair : pairs) {
    const PointMap map(points_of(pair.from, correction));
    const auto points = points_of(pair.to, correction);
    Matched result;
    result.wheels = pair.wheels;
    result.between = {pair.from.stamp, pair.to.stamp};
    const auto take = [&](const LineMatch& match) {
      result.scans = match.T_map_scan;
      result.known = match.converged && match.matched >= options_.least_matched;
      result.way_known = result.known && match.unknown_directions == 0;
      const double off = std::min(match.rms, kFit);
      result.misfit = match.matched * off * off + (1 - match.matched) * kFit * kFit;
    };
    const LineMatch near = match_lines(map, points, pair.wheels);
    take(near);
    if (!result.way_known || cost(result, {}) > options_.agrees) {
      const LineMatch far = searched(map, points, options_);
      if (far.converged && far.matched > near.matched) take(far);
    }
    all.push_back(result);
  }
  return all;
}

PlanarPose ScannerCheck::hypothetical(const PlanarPose& scans,
                                      const ScanCorrection& correction) const {
  const PlanarPose stated = seat(from_->lidar.T_body_lidar);
  const PlanarPose seen = seen_from(stated, scans);
  PlanarPose is = turned(stated, correction.yaw);
  is.x += correction.place.x();
  is.y += correction.place.y();
  return is * (correction.mirrored ? mirror_image(seen) : seen) * is.inverse();
}

double ScannerCheck::cost(const Matched& pair, const ScanCorrection& correction) const {
  if (!pair.known) return options_.most_cost;
  const PlanarPose scans = hypothetical(pair.scans, correction);
  const double way = pair.wheels.translation().norm(), turn = std::abs(pair.wheels.yaw);
  const double sigma_turn = options_.sigma_turn + options_.sigma_share * turn;
  const double sigma_way = options_.sigma_way + options_.sigma_share * way;
  double sum = std::pow(wrap_angle(scans.yaw - pair.wheels.yaw) / sigma_turn, 2);
  if (pair.way_known)
    sum +=
        (scans.translation() - pair.wheels.translation()).squaredNorm() / (sigma_way * sigma_way);
  return std::min(sum, options_.most_cost);
}

double ScannerCheck::cost(const std::vector<Matched>& pairs,
                          const ScanCorrection& correction) const {
  double sum = 0;
  for (const Matched& pair : pairs) sum += cost(pair, correction);
  return sum;
}

std::optional<double> ScannerCheck::turn_ratio(const std::vector<Matched>& pairs) const {
  std::vector<double> ratios;
  for (const Matched& pair : pairs) {
    if (pair.known && std::abs(pair.wheels.yaw) >= options_.turning)
      ratios.push_back(pair.scans.yaw / pair.wheels.yaw);
  }
  if (ratios.size() < options_.least_pairs) return std::nullopt;
  const double middle = median(ratios);
  for (double& ratio : ratios) ratio = std::abs(ratio - middle);
  return median(ratios) < options_.turn_spread * std::abs(middle) ? std::optional(middle)
                                                                  : std::nullopt;
}

// The direction that most ways agree on.
double ScannerCheck::heading(const std::vector<Matched>& pairs, bool mirrored) const {
  constexpr double kAgree = 0.35;  // rad
  const PlanarPose stated = seat(from_->lidar.T_body_lidar);
  std::vector<double> angles;
  for (const Matched& pair : pairs) {
    const PlanarPose wheels = seen_from(stated, pair.wheels);
    PlanarPose scans = seen_from(stated, pair.scans);
    if (mirrored) scans = mirror_image(scans);
    if (!pair.way_known || wheels.translation().norm() < options_.travelling ||
        scans.translation().norm() < options_.travelling)
      continue;
    angles.push_back(wrap_angle(std::atan2(wheels.y, wheels.x) - std::atan2(scans.y, scans.x)));
  }
  double best = 0;
  std::size_t most = 0;
  for (const double angle : angles) {
    double sum = 0;
    std::size_t count = 0;
    for (const double other : angles) {
      const double off = wrap_angle(other - angle);
      if (std::abs(off) > kAgree) continue;
      sum += off;
      ++count;
    }
    if (count <= most) continue;
    most = count;
    best = wrap_angle(angle + sum / static_cast<double>(count));
  }
  const bool observed = most >= options_.least_pairs && 3 * most >= 2 * angles.size();
  return observed && std::abs(best) >= options_.least_yaw ? best : 0;
}

// A scanner elsewhere by d moves by (I - R) d more in a turn R of the body: d by least squares,
// pairs that it leaves off are left out in the next round.
Eigen::Vector2d ScannerCheck::place(const std::vector<Matched>& pairs,
                                    const ScanCorrection& correction) const {
  ScanCorrection found = correction;
  for (int round = 0; round < options_.place_rounds; ++round) {
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    std::size_t turns = 0;
    for (const Matched& pair : pairs) {
      const bool fits = round == 0 || cost(pair, found) < options_.most_cost;
      if (!pair.way_known || std::abs(pair.wheels.yaw) < options_.turning || !fits) continue;
      const PlanarPose scans = hypothetical(pair.scans, correction);
      const Eigen::Matrix2d J = Eigen::Matrix2d::Identity() - scans.rotation();
      A += J.transpose() * J;
      b += J.transpose() * (pair.wheels.translation() - scans.translation());
      ++turns;
    }
    if (turns < options_.least_pairs) return correction.place;
    found.place = correction.place + Eigen::Vector2d(A.ldlt().solve(b));
  }
  return (found.place - correction.place).norm() >= options_.least_place ? found.place
                                                                         : correction.place;
}

// The aperture under which scans turn as wheels do; makers choose quarters of a degree.
double ScannerCheck::aperture_for(double turn_ratio) const {
  constexpr double kQuarter = M_PI / 720, kNear = 0.03;
  const double stated = std::abs(from_->angle_increment);
  const double found = stated / std::abs(turn_ratio);
  const double round = kQuarter * std::max(1.0, std::round(found / kQuarter));
  return (std::abs(round / found - 1) < kNear ? round : found) / stated;
}

void ScannerCheck::try_elsewhere(const std::vector<Matched>& pairs, Found& result) const {
  ScanCorrection elsewhere = result.correction;
  elsewhere.place = place(pairs, elsewhere);
  const double sum = cost(pairs, elsewhere);
  if (!(sum + 2 * options_.simpler < result.cost)) return;
  result.cost = sum;
  result.correction = elsewhere;
}

bool ScannerCheck::turns_are_reversed(const std::vector<Matched>& pairs) const {
  std::size_t turns = 0, against = 0;
  for (const Matched& pair : pairs) {
    if (!pair.known || std::abs(pair.wheels.yaw) < options_.turning) continue;
    ++turns;
    against += pair.scans.yaw * pair.wheels.yaw < 0;
  }
  return turns >= options_.least_pairs &&
         static_cast<double>(against) >= options_.turns_against * static_cast<double>(turns);
}

// The way scans turn says where to look, how well they fit each other whether it is there: drawn
// too wide or too narrow they bend.
std::optional<double> ScannerCheck::fitting_aperture(const std::vector<Matched>& stated) const {
  const auto ratio = turn_ratio(stated);
  if (!ratio || std::abs(std::abs(*ratio) - 1) <= options_.least_aperture) return std::nullopt;
  const auto matched = [&](double aperture) { return match_all(pairs_, {aperture, false, 0}); };
  // Turns of bent scans bend, too: twice is near enough.
  double aperture = aperture_for(*ratio);
  std::vector<Matched> other = matched(aperture);
  if (const auto left = turn_ratio(other)) {
    aperture = aperture_for(std::abs(*left) / aperture);
    other = matched(aperture);
  }
  const bool beyond_wheels = std::abs(std::abs(*ratio) - 1) > options_.turn_spread;
  const double most = (beyond_wheels ? 1 : options_.most_misfit) * total_misfit(stated);
  const double middle = total_misfit(other);
  // Wheels, too, turn by some per cent too much: the vertex of a parabola through three misfits.
  const double step = 2 * options_.least_aperture;
  const double less = total_misfit(matched(aperture * (1 - step))),
               more = total_misfit(matched(aperture * (1 + step)));
  const double bend = less + more - 2 * middle;
  const double vertex = 0.5 * (less - more) / bend;  // in steps
  if (bend > 0 && std::abs(vertex) < 1) aperture *= 1 + step * vertex;
  aperture = aperture_for(1 / aperture);
  return std::min({less, middle, more}) <= most ? std::optional(aperture) : std::nullopt;
}

ScannerCheck::Found ScannerCheck::found_all_along() const {
  std::vector<Matched> pairs = match_all(pairs_, {});
  Found result;
  result.cost_stated = cost(pairs, {});
  result.pairs = pairs_.size();
  ScanCorrection settled;
  if (const auto aperture = fitting_aperture(pairs)) {
    settled.aperture = *aperture;
    pairs = match_all(pairs_, settled);
  }
  settled.mirrored = turns_are_reversed(pairs);
  const double before = cost(pairs, settled);
  result.correction = settled;
  result.cost = before;
  if (!(before > options_.least_gain)) return result;
  double least = before;
  for (const bool mirrored : {false, true}) {
    for (const double yaw : {0.0, heading(pairs, mirrored)}) {
      const ScanCorrection hypothesis{settled.aperture, mirrored, yaw};
      const int parts = (mirrored != settled.mirrored) + (yaw != 0);
      const double sum = cost(pairs, hypothesis);
      if (!(sum + parts * options_.simpler < least)) continue;
      least = sum + parts * options_.simpler;
      result.cost = sum;
      result.correction = hypothesis;
    }
  }
  try_elsewhere(pairs, result);
  if (before - result.cost >= options_.least_gain && result.cost <= options_.most_ratio * before)
    return result;
  result.correction = settled;
  result.cost = before;
  return result;
}

std::vector<OwnBeam> ScannerCheck::own() const {
  std::vector<ScanPair> pairs;
  for (const Pairs* some : {&pairs_, &later_}) {
    for (const Pair& p : *some)
      pairs.push_back({&p.from, &p.to, seen_from(seat(p.from.lidar.T_body_lidar), p.wheels)});
  }
  return own_returns(pairs);
}

void ScannerCheck::correct(const ScanCorrection& correction) {
  for (Pairs* pairs : {&pairs_, &later_}) {
    for (Pair& pair : *pairs) {
      correction.apply(pair.from);
      correction.apply(pair.to);
    }
  }
}

std::optional<ScannerCheck::Found> ScannerCheck::found() const {
  if (several_ || pairs_.size() < options_.least_pairs) return std::nullopt;
  ScannerCheck rest = *this;
  ScanCorrection known;
  known.own = own();
  rest.correct(known);
  Found result = rest.found_all_along();
  rest.find_changes(result);
  if (result.correction.misread()) {  // by motions that now are right
    ScannerCheck right = *this;
    right.correct(result.correction);
    known.own = right.own();
  }
  result.correction.own = known.own;
  result.fan = {from_->angle_min, from_->angle_increment};
  return result.correction.any() ? std::optional(result) : std::nullopt;
}

}  // namespace lamina
