// How a level scanner's description contradicts the wheels: turns and ways of scans against theirs.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>
#include <lamina/frontend/motion/scan_points.hpp>
#include <lamina/sensors/laser_scan.hpp>
#include <lamina/sensors/scan_correction.hpp>

namespace lamina {

struct ScannerCheckOptions {
  double pair_turn = 0.15, pair_way = 0.4;  ///< rad, m by wheels that make a pair of scans
  double most_turn = 0.8, most_way = 1.0;   ///< rad, m: beyond, too little overlaps
  double turning = 0.1;                     ///< rad: a pair's turn counts
  double travelling = 0.15;                 ///< m: a pair's direction counts
  std::size_t most_pairs = 40;              ///< of either kind: a few milliseconds each
  std::size_t least_pairs = 8;              ///< of that kind, to decide anything
  /// Wheels against scans, 1-sigma: what a match errs by, and the share of the motion that wheels
  /// of a wrong radius or track are off by.
  double sigma_turn = 0.02, sigma_way = 0.03, sigma_share = 0.1;
  double most_cost = 16;       ///< of a pair: sigmas squared, beyond it fits nowhere
  double least_gain = 50;      ///< a hypothesis lowers the sum of costs by this,
  double most_ratio = 0.35;    ///< and to this share of it
  double simpler = 10;         ///< cost that each part of a hypothesis has to save
  double agrees = 4;           ///< cost: a match that begins at the wheels' motion and ends there
  double least_matched = 0.6;  ///< of a scan, for its match to count
  double least_yaw = 0.26;     ///< rad: smaller headings are the mounting calibration's
  double least_place = 0.2;    ///< m: smaller offsets are the mounting calibration's
  int place_rounds = 4;        ///< of least squares, without what the last one left off
  double least_aperture = 0.015;  ///< share: no scanner's is off by less
  double most_misfit = 0.93;      ///< of what it is as stated: so well scans fit with another one
  /// Share that wheels' turns are off by at most. Beyond, any better fit decides; turns by scans
  /// over those by wheels that scatter by more are no one ratio.
  double turn_spread = 0.12;
  double turns_against = 0.75;  ///< share of turns of the other sense that makes a mirror image
  double search_turn = 0.9, search_way = 0.8;  ///< rad, m: where a match is looked for
};

/// Gathers pairs of scans with the wheels' motion between them, matches each pair by the scans
/// alone, and scores every hypothesis (as stated; mirrored; another heading; another aperture; and
/// these together) by one cost: the sum over pairs of min(e' S^-1 e, most_cost), e what the motion
/// by scans is off the wheels'. A scanner of another heading goes another way. Two are settled
/// before, whatever else is wrong: a mirror image turns the other way; one of another aperture
/// turns by another amount, and its scans fit each other worse than with the right one, which needs
/// no wheels to tell. Where the beams' order changes on the way, pairs all along show it.
class ScannerCheck {
 public:
  explicit ScannerCheck(const ScannerCheckOptions& options = {}) : options_(options) {}

  /// Scans of a level scanner in turn; `wheels`: the body's motion since the scan before, nullopt
  /// where they do not tell it.
  void add(const LaserScan& scan, const std::optional<SE3>& wheels);
  /// False where more scans would change nothing: of several places.
  bool wants_more() const;

  struct Between {
    Timestamp from, to;
    Timestamp middle() const { return from + 0.5 * (to - from); }
  };
  struct Found {
    struct Fan {
      double angle_min = 0, angle_increment = 0;  ///< rad, as stated
      double angle(std::size_t i) const {
        return angle_min + static_cast<double>(i) * angle_increment;
      }
    };
    ScanCorrection correction;         ///< with stretches as fine as the turns are
    double cost_stated = 0, cost = 0;  ///< sums over the pairs
    std::size_t pairs = 0;
    /// Where the beams' order changes: between these stamps each.
    std::vector<Between> changes;
    Fan fan = {};  ///< whose beams correction.own counts
    double gain() const { return cost_stated - cost; }
  };
  /// What comes along with the robot (own_returns), and with that left out the best hypothesis over
  /// the first pairs where it clearly beats the description; nullopt where there is neither, or the
  /// pairs are too few.
  std::optional<Found> found() const;
  /// What lies between the first of these and the second, and so on.
  static std::vector<Stretch> stretches(const std::vector<Timestamp>& changes);
  /// How far two scans are apart beam by beam (mean of |a - b| / (a + b)) as they are, less with
  /// the order of the second reversed: above zero where the order changes between them.
  static double reversal(const LaserScan& one, const LaserScan& next);

 private:
  struct Pair {
    LaserScan from, to;
    PlanarPose wheels;
  };
  using Pairs = std::vector<Pair>;
  struct Matched {
    PlanarPose scans, wheels;               ///< of the body; the former with the scanner as stated
    bool known = false, way_known = false;  ///< its turn at least; all of it
    double misfit = 0;                      ///< m^2, mean over the scan, truncated
    Between between = {};                   ///< the two scans
  };
  void keep(const Pair& pair, bool turns, bool travels);
  using TwoCosts = std::array<double, 2>;  // as found, reversed
  void correct(const ScanCorrection& correction);
  std::vector<OwnBeam> own() const;
  void try_elsewhere(const std::vector<Matched>& pairs, Found& result) const;
  Found found_all_along() const;
  Pairs turns() const;
  std::vector<std::size_t> cheapest_states(const std::vector<TwoCosts>& costs) const;
  void find_changes(Found& found) const;
  std::vector<Matched> match_all(const Pairs& pairs, const ScanCorrection& correction) const;
  PlanarPose hypothetical(const PlanarPose& scans, const ScanCorrection& correction) const;
  double cost(const Matched& pair, const ScanCorrection& correction) const;
  double cost(const std::vector<Matched>& pairs, const ScanCorrection& correction) const;
  std::optional<double> turn_ratio(const std::vector<Matched>& pairs) const;
  bool turns_are_reversed(const std::vector<Matched>& pairs) const;
  std::optional<double> fitting_aperture(const std::vector<Matched>& stated) const;
  double heading(const std::vector<Matched>& pairs, bool mirrored) const;
  Eigen::Vector2d place(const std::vector<Matched>& pairs, const ScanCorrection& correction) const;
  double aperture_for(double turn_ratio) const;

  ScannerCheckOptions options_;
  Pairs pairs_, later_;  ///< the first ones; of turns after them, thinned evenly
  std::size_t passed_ = 0, every_ = 1;
  std::size_t turning_ = 0, travelling_ = 0;
  std::optional<LaserScan> from_;
  SE3 since_;
  double turned_ = 0, way_ = 0;
  bool several_ = false;  ///< scanners at several places: what corrects one would spoil another
};

}  // namespace lamina
