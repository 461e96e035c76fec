// Pieces of way over which the scans at both ends are laid onto each other.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/motion/paired_motion.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Cuts a way into pieces of half a metre or 0.6 rad, and says how the body moved over each: by
/// wheels, and by matching its last scan straight onto its first. Scan odometry leans on the wheels
/// where a scan is noisy, and so does the local map it makes of scans: of what a wrong mounting
/// makes wheels and scans differ by, it shows a part only. Two scans matched without a prior know
/// nothing of wheels.
class MatchedPieces {
 public:
  /// Takes scans in turn and keeps them by reference until pieces() was called. `by_wheels`,
  /// `by_scans`: the body's motion since the scan before (matching begins where `by_scans` leads);
  /// nullopt where one of them does not tell it: the piece begins anew with this scan.
  void add(const LaserScan& scan, const std::optional<SE3>& by_wheels,
           const std::optional<SE3>& by_scans);
  /// Pieces whose match holds all directions and finds most of the scan; of many, some hundreds
  /// evenly over the way are matched.
  std::vector<PairedMotion> pieces() const;

 private:
  struct Piece {
    const LaserScan *from, *to;
    PairedMotion moved;  // the scans' part by odometry
  };
  std::vector<Piece> pieces_;
  const LaserScan* from_ = nullptr;
  PairedMotion moved_;  // since from_
};

}  // namespace lamina
