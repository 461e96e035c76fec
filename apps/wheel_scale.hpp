// The scale of wheels as scans tell it over a whole recording, before it is mapped.
#pragma once

#include <optional>
#include <vector>

#include <lamina/apps/wheel_piece.hpp>
#include <lamina/sensors/odometry.hpp>

namespace lamina::apps {

/// In a corridor scans tell little of the way along it, and wheels of a wrong radius lengthen the
/// map. Over pieces of a metre, in each of which scans held all directions, the way by scans is
/// compared with that by wheels,
///   scale = sum(t_scans . t_wheels / |t_wheels|) / sum |t_wheels| - 1,
/// without the pieces beyond three sigmas of their usual scatter about the median (slipping,
/// counters without a sign). The variance is that of the sums of five pieces each about it, to
/// which the noise of wheels and scans is added as the word of six such sums: a few that agree by
/// chance claim no more than the noise lets them.
class WheelScale {
 public:
  struct Found {
    double scale = 0, sigma = 0;  ///< of the true way: (1 + scale) times the wheels'
    double way = 0;               ///< m by wheels that told it
  };

  explicit WheelScale(const OdometryModel& model) : model_(model) {}
  /// The body's motion since the last call, by wheels and by scans; nullopt where one of them does
  /// not tell it: the piece begins anew.
  void add(const std::optional<SE3>& by_wheels, const std::optional<SE3>& by_scans);
  /// nullopt: fewer than three sums, or a third of the pieces lies beyond the scatter.
  std::optional<Found> found() const;
  /// 150 m, or 60 m that tell it to a thousandth.
  bool told_enough() const;
  /// That it is no chance: four sigmas, five where less than 30 m told it: of the few sums the
  /// noise models say more than their own scatter does.
  static bool stands_out(const Found& found);
  /// That over a metre it is more than the wheels' stated noise: images and walls met again hold a
  /// path against less.
  bool beyond_noise(const Found& found) const;

 private:
  struct Piece {
    PieceLengths lengths;
    double variance;  // m^2: of their difference, by the noise models
  };
  std::vector<Piece> lawful() const;

  OdometryModel model_;
  PairedMotion piece_;   // since it began,
  double variance_ = 0;  // and of its wheels along the way, m^2
  std::vector<Piece> pieces_;
};

}  // namespace lamina::apps
