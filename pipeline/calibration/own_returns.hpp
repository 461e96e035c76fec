// What of the robot itself stands before its scanner: returns that come along.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>
#include <lamina/sensors/laser_scan.hpp>
#include <lamina/sensors/scan_correction.hpp>

namespace lamina {

struct OwnReturnOptions {
  double most_range = 2;       ///< m: what is aboard is no farther off
  double same = 0.02;          ///< m, and
  double same_sigmas = 4;      ///< of range_sigma: two ranges of one beam are one
  double off = 0.1;            ///< m, and
  double off_share = 0.2;      ///< of the motion: what wheels and beams say of a place at rest
  double way = 0.1;            ///< m by which a place at rest has to move in the scanner's frame
  std::size_t least = 6;       ///< pairs of scans in which a beam's return came along
  double times_at_rest = 3;    ///< that many times the pairs in which its return stayed at rest
  double met = 0.6;            ///< share of all returns met again or seen past that must be met
  double times_either = 0.25;  ///< and those that tell neither
};

/// Two scans of one scanner, and its pose at the second in that at the first.
struct ScanPair {
  const LaserScan* from = nullptr;
  const LaserScan* to = nullptr;
  PlanarPose T_from_to;
};

/// Beams whose returns move along with the robot: a mast, a wheel, a box aboard, a cart that is
/// pushed. Of two scans with a motion between them such a beam has one range in both, and where its
/// return would be were it at rest, the second scan sees past it. A wall that is driven along has
/// one range, too, and is met again where it was; so is a pillar that is driven around.
/// By beam: `ScanCorrection::own`; empty where there are none, and where the motions are not to be
/// used: most returns are not met again by them (wheels or a scanner that are not as stated). All
/// scans must be of one size, else empty. Cost: pairs times beams.
std::vector<OwnBeam> own_returns(std::span<const ScanPair> pairs,
                                 const OwnReturnOptions& options = {});

}  // namespace lamina
