// The lean of a level scanner, told by the ground that its lowest beams end on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include <lamina/frontend/segments/mounting_correction.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// A scanner that leans by u (its upward axis' part across, u = up_lidar.xy) h above the ground
/// sees it on the line
///   -u . (x, y) = h,
/// which stays where it is in the scanner while the body turns, as no wall does, and which no beam
/// passes. Gathers scans of turns and looks for the lean, of 1.1 degrees or more and off the stated
/// one by no more than 5.7, for which nine in ten of the beams that come as far as the line end on
/// it, sharply, several times as densely as before it, in three directions of heading or more and
/// in either half of the drive. The line tells u / h: the height above z = 0, the ground, is taken
/// as stated.
class GroundLean {
 public:
  /// Whether the scanner's height is stated: 5 cm or more.
  static bool may_tell(const LaserScan& scan);
  /// `turned`: how far the body has turned since the last scan (rad).
  void add(const LaserScan& scan, double turned);
  /// False once more scans would change nothing.
  bool wants_more() const;
  /// What must be done to the scanner's mounting; nullopt where no ground is seen, it is where the
  /// mounting has it (0.35 degrees), the height is not stated, or scans come from several
  /// mountings.
  std::optional<MountingCorrection> correction() const;

 private:
  struct Return {
    float cosine, sine, range;
    std::uint8_t heading;  ///< eighth of a turn
  };
  struct Evidence {
    int before = 0, on = 0, sharp = 0, beyond = 0, headings = 0;
    bool stops_beams() const;
    bool is_ground() const;
  };
  Evidence evidence(const Eigen::Vector2d& lean, std::size_t first, std::size_t end,
                    std::size_t every) const;
  std::optional<Eigen::Vector2d> fitted(Eigen::Vector2d lean) const;

  std::optional<SE3> T_body_lidar_;
  bool several_ = false;                         // scanners
  double heading_ = 0, turned_ = 0, since_ = 0;  // rad; the last since a scan was taken
  std::vector<Return> returns_;
};

}  // namespace lamina
