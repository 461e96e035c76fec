// The scale of wheels as scans tell it over a whole recording, before it is mapped.
#pragma once

#include <optional>

#include <lamina/frontend/motion/wheel_piece.hpp>
#include <lamina/models/block_evidence.hpp>
#include <lamina/sensors/odometry.hpp>

namespace lamina {

/// In a corridor scans tell little of the way along it, and wheels of a wrong radius lengthen the
/// map. Over pieces of a metre, in each of which scans held all directions, the way by scans is
/// compared with that by wheels,
///   t_scans . t_wheels / |t_wheels| = (1 + scale) |t_wheels|,
/// as evidence kept by blocks of time (BlockEvidence): pieces that slip or count without a sign
/// weigh little, and a slip that lasts is one block's.
class WheelScale {
 public:
  struct Found {
    double scale = 0, sigma = 0;  ///< of the true way: (1 + scale) times the wheels'
    double way = 0;               ///< m by wheels that told it
    Adoption adoption;
    double held = 0;  ///< share of the scans that hold all directions by themselves
    /// Wheels of a wrong scale have one, all along: where it scatters, scans may be what is wrong.
    bool is_one() const { return 2 * sigma < kBound * (1 + scale); }
  };
  /// Radii are worn and loaded by less; beyond, something else is wrong (units, another sensor).
  static constexpr double kBound = 0.1;
  /// Wheels and ranges as they are usually stated, 1-sigma; four of these are a contradiction.
  static constexpr double kPrior = 0.015;

  explicit WheelScale(const OdometryModel& model) : model_(model) {}
  /// The body's motion since the last call, by wheels and by scans, up to `stamp`; nullopt where
  /// one of them does not tell it: the piece begins anew.
  void add(Timestamp stamp, const std::optional<SE3>& by_wheels,
           const std::optional<SE3>& by_scans);
  /// nullopt for fewer than two blocks.
  std::optional<Found> found() const;
  /// 150 m, or 60 m that tell it to a thousandth.
  bool has_enough() const;
  /// That over a metre it is more than the wheels' stated noise: images and walls met again hold a
  /// path against less.
  bool beyond_noise(const Found& found) const;

 private:
  OdometryModel model_;
  PairedMotion piece_;   // since it began,
  double variance_ = 0;  // and of its wheels along the way, m^2
  BlockEvidence<1> pieces_;
  double way_ = 0;
  std::size_t steps_ = 0, held_ = 0;
};

}  // namespace lamina
