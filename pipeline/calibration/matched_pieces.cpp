// Pieces cut by the wheels' way, each matched once.
#include <lamina/pipeline/calibration/matched_pieces.hpp>

#include <algorithm>

#include <lamina/frontend/motion/line_matcher.hpp>
#include <lamina/frontend/motion/scan_points.hpp>

namespace lamina {
namespace {

constexpr double kPiece = 0.5, kPieceTurn = 0.6;  // m, rad
constexpr std::size_t kMost = 400;                // pieces matched: a millisecond or two each
constexpr double kThin = 0.02;                    // m: points nearer together add nothing
constexpr double kMatched = 0.6;                  // of the scan, at least
constexpr double kStart = 0.3;                    // m: what odometry errs by over a piece, at most

std::vector<OrientedPoint> points_of(const LaserScan& scan) {
  return thinned(oriented_points(scan), kThin);
}

}  // namespace

void MatchedPieces::add(const LaserScan& scan, const std::optional<SE3>& by_wheels,
                        const std::optional<SE3>& by_scans) {
  if (from_ && by_wheels && by_scans) {
    moved_.add(*by_wheels, *by_scans);
    if (moved_.turn < kPieceTurn && moved_.way < kPiece) return;
    pieces_.push_back({from_, &scan, moved_});
  }
  from_ = &scan;
  moved_ = {};
}

std::vector<PairedMotion> MatchedPieces::pieces() const {
  LineMatchOptions options;
  options.start_radius = kStart;
  std::vector<PairedMotion> all;
  const std::size_t count = std::min(kMost, pieces_.size());
  for (std::size_t k = 0; k < count; ++k) {
    const Piece& piece = pieces_[k * pieces_.size() / count];
    const LineMatch match = match_lines(PointMap(points_of(*piece.from)), points_of(*piece.to),
                                        planar_part(piece.moved.scans), {}, options);
    if (!match.converged || match.unknown_directions > 0 || match.matched < kMatched) continue;
    all.push_back(piece.moved);
    all.back().scans = lifted(match.T_map_scan);
    all.back().stamp = piece.to->stamp;
  }
  return all;
}

}  // namespace lamina
