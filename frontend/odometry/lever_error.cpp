// Pieces of way as rows of a small least-squares problem.
#include <lamina/frontend/odometry/lever_error.hpp>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <lamina/frontend/odometry/planar.hpp>

namespace lamina {
namespace {

constexpr double kPiece = 0.5, kPieceTurn = 0.6;    // m, rad
constexpr double kTurns = 0.3;                      // rad: such a piece tells of the lever
constexpr double kBySlip = 0.02, kByMatch = 0.005;  // m per sqrt(m), m: relative weights
constexpr std::size_t kLeastPieces = 6;
constexpr double kOutlier = 2.5;  // sigmas
constexpr int kRounds = 6;

Eigen::Matrix2d rotation(double angle) { return PlanarPose{0, 0, angle}.rotation(); }

}  // namespace

void LeverError::add(const std::optional<SE3>& by_wheels, const std::optional<SE3>& by_scans) {
  if (by_wheels && by_scans) {
    piece_.add(*by_wheels, *by_scans);
    if (piece_.turn < kPieceTurn && piece_.way < kPiece) return;
    const PlanarPose w = planar_part(piece_.wheels), s = planar_part(piece_.scans);
    const Eigen::Vector2d t = rotation(0.5 * wrap_angle(s.yaw - w.yaw)) * w.translation();
    Piece piece;
    piece.A.col(0) = Eigen::Vector2d(-t.y(), t.x());
    piece.A.col(1) = t;
    piece.A.rightCols<2>() = Eigen::Matrix2d::Identity() - rotation(s.yaw);
    piece.d = s.translation() - t;
    piece.sigma = std::sqrt(kBySlip * kBySlip * piece_.way + kByMatch * kByMatch);
    piece.turns = std::abs(s.yaw) > kTurns;
    pieces_.push_back(piece);
  }
  piece_ = {};
}

std::optional<LeverError::Result> LeverError::result() const {
  const auto turning =
      std::count_if(pieces_.begin(), pieces_.end(), [](const Piece& piece) { return piece.turns; });
  if (static_cast<std::size_t>(turning) < kLeastPieces) return std::nullopt;
  Eigen::Vector4d x = Eigen::Vector4d::Zero();
  Eigen::Matrix4d H;
  double sigma = 1e9;  // of a residual in its piece's own sigmas
  for (int round = 0; round < kRounds; ++round) {
    H = 1e-9 * Eigen::Matrix4d::Identity();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    for (const Piece& piece : pieces_) {
      if ((piece.d - piece.A * x).norm() > kOutlier * sigma * piece.sigma) continue;
      const double weight = 1 / (piece.sigma * piece.sigma);
      H += weight * piece.A.transpose() * piece.A;
      b += weight * piece.A.transpose() * piece.d;
    }
    x = H.ldlt().solve(b);
    std::vector<double> misfits;
    for (const Piece& piece : pieces_) {
      misfits.push_back((piece.d - piece.A * x).norm() / piece.sigma);
    }
    const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(misfits.size() / 2);
    std::nth_element(misfits.begin(), middle, misfits.end());
    // The median length of two normal components is 1.1774 sigmas.
    sigma = std::max(1e-6, *middle / 1.1774);
  }
  return Result{x.tail<2>(), sigma * sigma * H.inverse().bottomRightCorner<2, 2>()};
}

}  // namespace lamina
