// A grid over the offset, then weighted least squares with the covariance of clustered residuals.
#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/clock_offset.hpp>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace lamina {
namespace {

constexpr double kPiece = 0.1;        // s, the shortest piece: noise of ends counts less
constexpr double kSplit = 1;          // s: a longer one says nothing of when
constexpr double kTurns = 0.01;       // rad: less is standing still or driving straight
constexpr double kByTurn = 0.02;      // of a turn: slip
constexpr double kStep = 0.005;       // s, of the grid and of differences
constexpr double kStretch = 4;        // s
constexpr double kScaleSigma = 0.05;  // of s, prior
constexpr std::size_t kLeastPieces = 20;
constexpr double kMedian = 0.6745;  // of |normal| of variance 1
constexpr int kRounds = 10;

// By how much the turn rate changes over a piece, by the sensor alone: from the piece before to the
// one after. nullopt where these do not follow each other.
template <class Pieces>
std::optional<double> change_of_rate(const Pieces& pieces, std::size_t i) {
  if (i == 0 || i + 1 >= pieces.size()) return std::nullopt;
  const auto &before = pieces[i - 1], &after = pieces[i + 1];
  if (before.to != pieces[i].from || after.from != pieces[i].to) return std::nullopt;
  return (after.yaw / (after.to - after.from) - before.yaw / (before.to - before.from)) / 2;
}

// What the sensor alone makes of the offset's variance. A gradient of noisy wheels is noise, too:
// squared it passes for information, and least squares puts d amid two samples, where interpolation
// leaves least of it. Rates by the sensor know nothing of that noise: with them as instruments z
// (and the turns themselves for s) d is known to (Z^T J)^-1 (sum of pulls squared) (Z^T J)^-T, and
// not better than they agree.
class Instrument {
 public:
  explicit Instrument(double prior) { cross_(1, 1) = prior; }
  void add(int stretch, double weight, const Eigen::Vector2d& z, const Eigen::Vector2d& j,
           double r) {
    cross_ += weight * z * j.transpose();
    pulls_.try_emplace(stretch, Eigen::Vector2d::Zero()).first->second += weight * r * z;
    ++count_;
  }
  // 0 where too few pieces have neighbours to tell.
  double variance() const {
    if (count_ < kLeastPieces) return 0;
    if (std::abs(cross_.determinant()) < 1e-12) return std::numeric_limits<double>::infinity();
    const Eigen::Matrix2d inverse = cross_.inverse();
    double sum = 0, shift = 0;  // where the sensor's rates have d, from here
    for (const auto& [number, pull] : pulls_) {
      const double one = inverse.row(0).dot(pull);
      shift += one;
      sum += one * one;
    }
    return sum + shift * shift;
  }

 private:
  Eigen::Matrix2d cross_ = Eigen::Matrix2d::Zero();
  std::map<int, Eigen::Vector2d> pulls_;
  std::size_t count_ = 0;
};

// A piece's residual, in its sigmas, and the derivatives of what is expected by d and s.
struct Row {
  Eigen::Vector2d j;
  double r;
};

double robust_spread(const std::vector<Row>& rows) {
  std::vector<double> sizes;
  for (const Row& row : rows) sizes.push_back(std::abs(row.r));
  return std::max(1e-3, median(sizes) / kMedian);
}

// Of d and s, with residuals that are clustered by stretches.
class NormalEquations {
 public:
  NormalEquations(double spread, double s) : spread_(spread), b_(0, -s * prior()) {
    H_(1, 1) = prior();
  }
  void add(int number, double weight, const Row& row) {
    const auto& [j, r] = row;
    H_ += weight * j * j.transpose();
    b_ += weight * r * j;
    Stretch& stretch = stretches_[number];
    stretch.pull += weight * r * j;
    stretch.information += weight * j(0) * j(0);
  }
  double prior() const { return spread_ * spread_ / (kScaleSigma * kScaleSigma); }
  bool offset_observed() const { return H_(0, 0) > 0; }
  Eigen::Vector2d step() const { return H_.inverse() * b_; }
  // Stretches counted by their information.
  double effective_stretches() const {
    double sum = 0, squares = 0;
    for (const auto& [number, stretch] : stretches_) {
      sum += stretch.information;
      squares += stretch.information * stretch.information;
    }
    return sum * sum / squares;
  }
  double offset_variance(double count) const {
    Eigen::Matrix2d sandwich = Eigen::Matrix2d::Zero();
    for (const auto& [number, stretch] : stretches_) {
      sandwich += stretch.pull * stretch.pull.transpose();
    }
    const Eigen::Matrix2d inverse = H_.inverse();
    const double few = count / (count - 1);  // as for a sample's variance
    return std::max(few * (inverse * sandwich * inverse)(0, 0), spread_ * spread_ * inverse(0, 0));
  }

 private:
  struct Stretch {
    Eigen::Vector2d pull = Eigen::Vector2d::Zero();
    double information = 0;
  };
  double spread_;
  Eigen::Matrix2d H_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b_;
  std::map<int, Stretch> stretches_;
};

}  // namespace

bool ClockOffset::Result::is_significant() const {
  constexpr double kWheels = 0.0025;  // s, sigma: when counters were read
  constexpr double kSigmas = 5, kStretches = 3;
  return std::abs(value) >= kSigmas * std::hypot(sigma, kWheels) && stretches >= kStretches;
}

void ClockOffset::add(Timestamp from, Timestamp to, double yaw, double sigma) {
  if (!(to > from) || to - from > kSplit) return;
  if (!pieces_.empty()) {
    Piece& last = pieces_.back();
    if (last.to == from && last.to - last.from < kPiece) {
      last.to = to;
      last.yaw += yaw;
      last.sigma = std::max(last.sigma, sigma);
      return;
    }
  }
  pieces_.push_back({from, to, yaw, sigma});
}

// Offset d and scale s from the pieces about which the odometry tells at every offset, and that
// turn at some.
class ClockOffset::Fit {
 public:
  Fit(const std::vector<Piece>& pieces, const TurnTrack& odometry) : odometry_(odometry) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (!usable(pieces[i])) continue;
      used_.push_back(pieces[i]);
      changes_.push_back(change_of_rate(pieces, i));
    }
  }
  std::size_t pieces() const { return used_.size(); }
  bool at_end_of_range() const { return std::abs(d_) > kRange - kStep; }
  void search_grid();
  // One Gauss-Newton step; nullopt where d is not observed.
  std::optional<Result> step();

 private:
  static double expected_sigma(const Piece& piece) {
    return std::hypot(piece.sigma, kByTurn * piece.yaw);
  }
  static int grid_steps() { return static_cast<int>(std::lround(kRange / kStep)); }
  std::optional<double> turned(const Piece& piece, double d) const {
    const auto from = odometry_.at(piece.from + d), to = odometry_.at(piece.to + d);
    if (!from || !to) return std::nullopt;
    return *to - *from;
  }
  bool usable(const Piece& piece) const;
  std::vector<Row> rows() const;

  const TurnTrack& odometry_;
  std::vector<Piece> used_;
  std::vector<std::optional<double>> changes_;  // of their turn rates, by the sensor
  double d_ = 0, s_ = 0;
};

bool ClockOffset::Fit::usable(const Piece& piece) const {
  bool turns = std::abs(piece.yaw) > kTurns;
  for (int k = -grid_steps() - 1; k <= grid_steps() + 1; ++k) {
    const auto yaw = turned(piece, k * kStep);
    if (!yaw) return false;
    turns = turns || std::abs(*yaw) > kTurns;
  }
  return turns;
}

void ClockOffset::Fit::search_grid() {
  double least = 1e300;
  for (int k = -grid_steps(); k <= grid_steps(); ++k) {
    double sum = 0;
    for (const Piece& piece : used_) {
      sum += std::abs(piece.yaw - *turned(piece, k * kStep)) / expected_sigma(piece);
    }
    if (sum < least) {
      least = sum;
      d_ = k * kStep;
    }
  }
}

std::vector<Row> ClockOffset::Fit::rows() const {
  std::vector<Row> rows;
  for (const Piece& piece : used_) {
    const double sigma = expected_sigma(piece);
    const double yaw = *turned(piece, d_);
    const double rate = (*turned(piece, d_ + kStep) - *turned(piece, d_ - kStep)) / (2 * kStep);
    rows.push_back(
        {Eigen::Vector2d((1 + s_) * rate, yaw) / sigma, (piece.yaw - (1 + s_) * yaw) / sigma});
  }
  return rows;
}

std::optional<ClockOffset::Result> ClockOffset::Fit::step() {
  const std::vector<Row> all = rows();
  const double spread = robust_spread(all);
  NormalEquations equations(spread, s_);
  Instrument instrument(equations.prior());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto& [j, r] = all[i];
    const double weight = 1 / (1 + std::pow(r / (2 * spread), 2));
    const int number = static_cast<int>((used_[i].from - used_[0].from) / kStretch);
    equations.add(number, weight, all[i]);
    if (changes_[i])
      instrument.add(number, weight, {*changes_[i] / expected_sigma(used_[i]), j(1)}, j, r);
  }
  if (!equations.offset_observed()) return std::nullopt;
  const double count = equations.effective_stretches();
  if (!(count > 1 + 1e-6)) return std::nullopt;
  const Eigen::Vector2d step = equations.step();
  d_ += std::clamp(step(0), -2 * kStep, 2 * kStep);
  s_ += step(1);
  const double variance = std::max(equations.offset_variance(count), instrument.variance());
  return Result{d_, std::sqrt(variance), count};
}

std::optional<ClockOffset::Result> ClockOffset::result(const TurnTrack& odometry) const {
  Fit fit(pieces_, odometry);
  if (fit.pieces() < kLeastPieces) return std::nullopt;
  fit.search_grid();
  std::optional<Result> result;
  for (int round = 0; round < kRounds; ++round) {
    if (fit.at_end_of_range()) return std::nullopt;
    result = fit.step();
    if (!result) return std::nullopt;
  }
  if (fit.at_end_of_range()) return std::nullopt;
  return result;
}

}  // namespace lamina
