// The lean and height of a scanner that sees the ground, told by the ground.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <lamina/frontend/segments/mounting_correction.hpp>
#include <lamina/models/observation.hpp>

namespace lamina {

/// Gathers the lines that a scanner sees where the ground should be (z = 0 of a body on wheels),
/// one a scan, and says how the scanner must lean and stand for them to lie on it:
///   d_z + (w x d)_z = 0,  p_z + (w x (p - o))_z + h = 0,
/// d, p direction and middle of a line as calibrated, o the scanner, (w_x, w_y, h) unknown, zero to
/// 1.5 degrees and 2 cm: what one fan cannot tell apart stays as calibrated. Heading is not told.
class GroundLines {
 public:
  /// Takes a scan; one without such a line counts as none.
  void add(const Observations& observations);
  /// nullopt where most scans show no ground, lines do not agree on one, or what they say is no
  /// more than the ground's own unevenness (0.1 degrees, 5 mm).
  std::optional<MountingCorrection> correction() const;

 private:
  bool adopted() const;

  struct Line {
    Eigen::Vector3d direction_body, middle_body;
    Eigen::Vector3d scanner_body;
    Timestamp stamp;
  };
  std::vector<Line> lines_;
  std::size_t scans_ = 0;
};

}  // namespace lamina
