// A grid over the offset, then weighted least squares with the covariance of clustered residuals.
#include <lamina/frontend/odometry/clock_offset.hpp>

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

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

bool ClockOffset::Result::stands_out() const {
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

std::optional<ClockOffset::Result> ClockOffset::result(const TurnTrack& odometry) const {
  const auto turned = [&odometry](const Piece& piece, double d) -> std::optional<double> {
    const auto from = odometry.at(piece.from + d), to = odometry.at(piece.to + d);
    if (!from || !to) return std::nullopt;
    return *to - *from;
  };
  // Pieces about which the odometry tells at every offset, and that turn at some.
  std::vector<Piece> used;
  std::vector<std::optional<double>> changes;  // of their turn rates, by the sensor
  const int steps = static_cast<int>(std::lround(kRange / kStep));
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Piece& piece = pieces_[i];
    bool turns = std::abs(piece.yaw) > kTurns, whole = true;
    for (int k = -steps - 1; k <= steps + 1 && whole; ++k) {
      const auto yaw = turned(piece, k * kStep);
      whole = yaw.has_value();
      turns = turns || (yaw && std::abs(*yaw) > kTurns);
    }
    if (!turns || !whole) continue;
    used.push_back(piece);
    changes.push_back(change_of_rate(pieces_, i));
  }
  if (used.size() < kLeastPieces) return std::nullopt;
  const auto expected_sigma = [](const Piece& piece) {
    return std::hypot(piece.sigma, kByTurn * piece.yaw);
  };
  double d = 0, least = 1e300;
  for (int k = -steps; k <= steps; ++k) {
    double sum = 0;
    for (const Piece& piece : used) {
      sum += std::abs(piece.yaw - *turned(piece, k * kStep)) / expected_sigma(piece);
    }
    if (sum < least) {
      least = sum;
      d = k * kStep;
    }
  }
  double s = 0;
  Result result;
  for (int round = 0; round < kRounds; ++round) {
    if (std::abs(d) > kRange - kStep) return std::nullopt;
    struct Row {
      Eigen::Vector2d j;
      double r;
    };
    std::vector<Row> rows;
    std::vector<double> sizes;
    for (const Piece& piece : used) {
      const double sigma = expected_sigma(piece);
      const double yaw = *turned(piece, d);
      const double rate = (*turned(piece, d + kStep) - *turned(piece, d - kStep)) / (2 * kStep);
      rows.push_back(
          {Eigen::Vector2d((1 + s) * rate, yaw) / sigma, (piece.yaw - (1 + s) * yaw) / sigma});
      sizes.push_back(std::abs(rows.back().r));
    }
    const double spread = std::max(1e-3, median(sizes) / kMedian);
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero(), sandwich = Eigen::Matrix2d::Zero();
    Instrument instrument(spread * spread / (kScaleSigma * kScaleSigma));
    H(1, 1) = spread * spread / (kScaleSigma * kScaleSigma);
    Eigen::Vector2d b(0, -s * H(1, 1));
    struct Stretch {
      Eigen::Vector2d pull = Eigen::Vector2d::Zero();
      double information = 0;
    };
    std::map<int, Stretch> stretches;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto& [j, r] = rows[i];
      const double weight = 1 / (1 + std::pow(r / (2 * spread), 2));
      H += weight * j * j.transpose();
      b += weight * r * j;
      const int number = static_cast<int>((used[i].from - used[0].from) / kStretch);
      if (changes[i])
        instrument.add(number, weight, {*changes[i] / expected_sigma(used[i]), j(1)}, j, r);
      Stretch& stretch = stretches[number];
      stretch.pull += weight * r * j;
      stretch.information += weight * j(0) * j(0);
    }
    if (!(H(0, 0) > 0)) return std::nullopt;
    const Eigen::Matrix2d inverse = H.inverse();
    const Eigen::Vector2d step = inverse * b;
    double sum = 0, squares = 0;
    for (const auto& [number, stretch] : stretches) {
      sandwich += stretch.pull * stretch.pull.transpose();
      sum += stretch.information;
      squares += stretch.information * stretch.information;
    }
    const double count = sum * sum / squares;
    if (!(count > 1 + 1e-6)) return std::nullopt;
    const double few = count / (count - 1);  // as for a sample's variance
    const double variance =
        std::max(few * (inverse * sandwich * inverse)(0, 0), spread * spread * inverse(0, 0));
    d += std::clamp(step(0), -2 * kStep, 2 * kStep);
    s += step(1);
    result = {d, std::sqrt(std::max(variance, instrument.variance())), count};
  }
  if (std::abs(d) > kRange - kStep) return std::nullopt;
  return result;
}

}  // namespace lamina
