// Pieces of the way as facts of one parameter.
#include <lamina/pipeline/calibration/wheel_scale.hpp>

#include <cmath>

namespace lamina {
namespace {

constexpr std::size_t kMostPieces = 150, kEnoughPieces = 60, kAskEvery = 5;
constexpr double kEnough = 0.001;

}  // namespace

void WheelScale::add(Timestamp stamp, const std::optional<SE3>& by_wheels,
                     const std::optional<SE3>& by_scans) {
  ++steps_;
  held_ += by_scans.has_value();
  if (by_wheels && by_scans) {
    piece_.add(*by_wheels, *by_scans);
    variance_ += increment_covariance(model_, *by_wheels)(0, 0);
    if (!is_whole(piece_)) return;
    if (const auto lengths = lengths_of(piece_)) {
      pieces_.add(stamp, BlockEvidence<1>::Vector(lengths->wheels),
                  lengths->scans - lengths->wheels, std::sqrt(variance_ + kScanShift * kScanShift));
      way_ += lengths->wheels;
    }
  }
  piece_ = {};
  variance_ = 0;
}

std::optional<WheelScale::Found> WheelScale::found() const {
  // Of a wide prior: a contradiction is to be seen as large as it is.
  const auto found = pieces_.solve(BlockEvidence<1>::Vector::Ones(), {0});
  if (!found) return std::nullopt;
  const double held = static_cast<double>(held_) / static_cast<double>(steps_);
  return Found{found->value(0), std::sqrt(found->covariance(0, 0)), way_, found->adoption, held};
}

bool WheelScale::has_enough() const {
  if (pieces_.size() >= kMostPieces) return true;
  if (pieces_.size() < kEnoughPieces || pieces_.size() % kAskEvery != 0) return false;
  const auto so_far = found();
  return so_far && so_far->adoption.blocks >= AdoptionOptions().least_blocks &&
         so_far->sigma <= kEnough;
}

bool WheelScale::beyond_noise(const Found& found) const {
  const Matrix6d of_a_metre = increment_covariance(model_, SE3::planar(1, 0, 0));
  return found.scale * found.scale > of_a_metre(0, 0);
}

}  // namespace lamina
