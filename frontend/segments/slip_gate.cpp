// What is not known of the ends of a line: at which beam its corners are, and whether it hides one.
#include <cmath>
#include <optional>

#include <lamina/frontend/segments/segment_extractor.hpp>

namespace lamina {
namespace {
// Odds, before anything is seen, that a straight run hides a corner. The three parameters that a
// corner takes are charged log(n) / 2 each [Schwarz1978].
constexpr double kCornerPrior = 0.02;

// (rho, theta) of the best line; nullopt when there is none.
std::optional<Eigen::Vector2d> line_of(const InverseRangeSums& sums) {
  double A = 0, B = 0;
  if (!sums.solve(A, B)) return std::nullopt;
  return Eigen::Vector2d(1 / std::hypot(A, B), std::atan2(B, A));
}

void add_spread(Eigen::Vector2d off, double weight, Eigen::Matrix2d& spread) {
  off(1) = std::remainder(off(1), 2 * M_PI);
  spread += weight * off * off.transpose();
}
}  // namespace

// The corner could as well be at beam k with the likelihood exp(-cost(k) / 2): the spread of the
// two lines over those places, about the ones chosen.
void SegmentExtractor::uncertain_boundary(Run& a, Run& b) const {
  const std::optional<Eigen::Vector2d> line_a = line_of(a.sums), line_b = line_of(b.sums);
  if (!line_a || !line_b) return;
  const int start = b.begin(), low = lowest_boundary(a), high = highest_boundary(b);
  const double least = a.sums.cost() + b.sums.cost();
  double total = 1;
  Eigen::Matrix2d spread_a = Eigen::Matrix2d::Zero(), spread_b = Eigen::Matrix2d::Zero();
  for (const int direction : {-1, 1}) {
    for (int k = start + direction; k >= low && k <= high; k += direction) {
      const Sides sides = divided_at(a, b, k);
      const double worse = sides.cost() - least;
      if (worse > options_.corner_gate) break;
      const std::optional<Eigen::Vector2d> la = line_of(sides.a), lb = line_of(sides.b);
      if (!la || !lb) break;
      const double likelihood = std::exp(-0.5 * worse);
      total += likelihood;
      add_spread(*la - *line_a, likelihood, spread_a);
      add_spread(*lb - *line_b, likelihood, spread_b);
    }
  }
  a.uncertain_end = spread_a / total;
  b.uncertain_begin = spread_b / total;
}

// A corner too flat to be split at may hide in the run: the change it would make to the line of the
// larger side, by the probability that it is there.
Eigen::Matrix2d SegmentExtractor::hidden_corner(const Run& run) const {
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  const std::optional<Eigen::Vector2d> whole = line_of(run.sums);
  if (!whole || run.sums.count < 2 * options_.min_points) return spread;
  double most = 0;
  InverseRangeSums before, larger;
  for (const auto& [begin, end] : run.parts) {
    const InverseRangeSums after = run.sums - before - points_.sums(begin, end);
    double gain = 0;
    if (end - begin >= 4) {
      const int k = best_split(begin, end, before, after, gain);
      const InverseRangeSums left = before + points_.sums(begin, k);
      if (gain > most) larger = 2 * left.count > run.sums.count ? left : run.sums - left;
    }
    most = std::max(most, gain);
    before = before + points_.sums(begin, end);
  }
  const std::optional<Eigen::Vector2d> side = line_of(larger);
  if (!side) return spread;
  const double odds =
      kCornerPrior * std::exp(0.5 * most) / std::pow(static_cast<double>(run.sums.count), 1.5);
  add_spread(*side - *whole, odds / (1 + odds), spread);
  return spread;
}

}  // namespace lamina
