// Robust sums of pieces of the way.
#include <lamina/apps/wheel_scale.hpp>

#include <algorithm>
#include <cmath>

namespace lamina::apps {
namespace {

constexpr std::size_t kPiecesOfSum = 5, kLeastSums = 3;
constexpr double kNoiseWord = 6;  // sums
constexpr std::size_t kMostPieces = 150, kEnoughPieces = 60;
constexpr double kEnough = 0.001;
constexpr double kBeyond = 3, kStandsOut = 4, kShortStandsOut = 5;  // sigmas
constexpr double kShort = 30;                                       // m

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void WheelScale::add(const std::optional<SE3>& by_wheels, const std::optional<SE3>& by_scans) {
  if (by_wheels && by_scans) {
    piece_.add(*by_wheels, *by_scans);
    variance_ += increment_covariance(model_, *by_wheels)(0, 0);
    if (!is_whole(piece_)) return;
    if (const auto lengths = lengths_of(piece_))
      pieces_.push_back({*lengths, variance_ + kScanShift * kScanShift});
  }
  piece_ = {};
  variance_ = 0;
}

std::vector<WheelScale::Piece> WheelScale::lawful() const {
  std::vector<double> values;
  for (const Piece& p : pieces_) values.push_back(p.lengths.scans / p.lengths.wheels);
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  const double scatter = 1.4826 * median(values);  // a Gaussian's sigma
  std::vector<Piece> kept;
  for (const Piece& p : pieces_) {
    if (std::abs(p.lengths.scans / p.lengths.wheels - middle) <= kBeyond * scatter)
      kept.push_back(p);
  }
  return kept;
}

std::optional<WheelScale::Found> WheelScale::found() const {
  if (pieces_.size() < kPiecesOfSum * kLeastSums) return std::nullopt;
  const std::vector<Piece> kept = lawful();
  const std::size_t sums = kept.size() / kPiecesOfSum;
  if (sums < kLeastSums || 3 * kept.size() < 2 * pieces_.size()) return std::nullopt;
  double wheels = 0, scans = 0, by_noise = 0;
  for (const Piece& p : kept) {
    wheels += p.lengths.wheels;
    scans += p.lengths.scans;
    by_noise += p.variance;
  }
  const double scale = scans / wheels - 1;
  double by_scatter = 0;
  for (std::size_t i = 0; i < sums; ++i) {
    double off = 0;
    for (std::size_t k = i * kPiecesOfSum; k < (i + 1) * kPiecesOfSum; ++k)
      off += kept[k].lengths.scans - (1 + scale) * kept[k].lengths.wheels;
    by_scatter += off * off;
  }
  const double n = static_cast<double>(sums);
  // Both are variances of the sum of all; the mean is one sum's worth less.
  const double variance = (n * by_scatter + kNoiseWord * by_noise) / (n - 1 + kNoiseWord);
  return Found{scale, std::sqrt(variance) / wheels, wheels};
}

bool WheelScale::told_enough() const {
  if (pieces_.size() >= kMostPieces) return true;
  if (pieces_.size() < kEnoughPieces || pieces_.size() % kPiecesOfSum != 0) return false;
  const auto so_far = found();
  return so_far && so_far->sigma <= kEnough;
}

bool WheelScale::stands_out(const Found& found) {
  const double least = found.way < kShort ? kShortStandsOut : kStandsOut;
  return std::abs(found.scale) >= least * found.sigma;
}

bool WheelScale::beyond_noise(const Found& found) const {
  const Matrix6d of_a_metre = increment_covariance(model_, SE3::planar(1, 0, 0));
  return found.scale * found.scale > of_a_metre(0, 0);
}

}  // namespace lamina::apps
