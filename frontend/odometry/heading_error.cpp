// Pieces of way, their directions, and the mean of those near the median.
#include <lamina/frontend/odometry/heading_error.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/odometry/planar.hpp>

namespace lamina {
namespace {

constexpr double kPiece = 0.5;      // m: centimetres of scan matching are a degree or two
constexpr double kMostTurn = 0.35;  // rad within a piece: half of it is the chord's direction
constexpr std::size_t kLeastPieces = 20;
constexpr double kOutlier = 2.5;  // sigmas from the median

double direction(const SE3& moved) {
  const PlanarPose p = planar_part(moved);
  return std::atan2(p.y, p.x) - 0.5 * p.yaw;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void HeadingError::add(const std::optional<SE3>& by_wheels, const std::optional<SE3>& by_scans) {
  if (by_wheels && by_scans) {
    piece_.add(*by_wheels, *by_scans);
    if (piece_.turn <= kMostTurn && piece_.way < kPiece) return;
    // Not where the robot went to and fro.
    const double way =
        std::min(piece_.wheels.translation().norm(), piece_.scans.translation().norm());
    if (piece_.turn <= kMostTurn && way > 0.8 * kPiece)
      deltas_.push_back(wrap_angle(direction(piece_.scans) - direction(piece_.wheels)));
  }
  piece_ = {};
}

std::optional<HeadingError::Result> HeadingError::result() const {
  if (deltas_.size() < kLeastPieces) return std::nullopt;
  std::vector<double> values = deltas_;
  const double middle = median(values);
  for (double& v : values) v = std::abs(v - middle);
  const double sigma = 1.4826 * median(values);  // of one piece
  double sum = 0, count = 0;
  for (const double delta : deltas_) {
    if (std::abs(delta - middle) > kOutlier * sigma) continue;
    sum += delta;
    ++count;
  }
  return Result{-sum / count, sigma / std::sqrt(count)};
}

}  // namespace lamina
