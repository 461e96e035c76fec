// Pieces of way over which wheels are compared with scans.
#pragma once

#include <Eigen/Core>
#include <optional>

#include <lamina/frontend/motion/paired_motion.hpp>

namespace lamina {

inline constexpr double kPieceWay = 1, kPieceTurn = 0.5;  ///< m, rad; one of them makes a piece
inline constexpr double kScanShift = 0.015;  ///< m, 1-sigma: of a piece's two ends by scans

inline bool is_whole(const PairedMotion& piece) {
  return piece.way >= kPieceWay || piece.turn >= kPieceTurn;
}

/// m, along the wheels' way of a piece.
struct PieceLengths {
  double wheels = 0, scans = 0;
};

/// nullopt on a piece that hardly leads anywhere: its length says nothing of the scale.
inline std::optional<PieceLengths> lengths_of(const PairedMotion& piece) {
  const Eigen::Vector2d t = piece.wheels.translation().head<2>();
  if (t.norm() <= kPieceWay / 2) return std::nullopt;
  return PieceLengths{t.norm(), piece.scans.translation().head<2>().dot(t) / t.norm()};
}

}  // namespace lamina
