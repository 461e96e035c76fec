// What a level scanner's description has wrong, and scans as they are with that put right.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// A stretch of a recording.
struct Stretch {
  Timestamp from;
  std::optional<Timestamp> until;  ///< nullopt: to the end
  bool has(Timestamp stamp) const { return !(stamp < from) && (!until || stamp < *until); }
};

/// Ranges of one beam (m) at which it meets the robot itself.
struct OwnBeam {
  double near = 0, far = 0;
  bool any() const { return far > 0; }
  bool has(float range) const {
    return any() && near <= static_cast<double>(range) && static_cast<double>(range) <= far;
  }
};

/// Applied in this order. The identity when nothing is wrong.
struct ScanCorrection {
  double aperture = 1;  ///< times the stated angle between beams, about the middle of the fan
  bool mirrored =
      false;       ///< beams run the other way: clockwise, or a scanner that hangs upside down
  double yaw = 0;  ///< rad about the body's z, added to the stated heading of the scanner

  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< m, added to the stated place in the body

  std::vector<Stretch> reversed = {};  ///< there beams run the other way than in the rest
  std::vector<OwnBeam> own = {};  ///< by beam, of scans that have as many: no measurement (NaN)

  bool any() const { return misread() || !own.empty(); }
  /// The scanner or its beams are not as stated.
  bool misread() const {
    return aperture != 1 || mirrored || yaw != 0 || !reversed.empty() || !place.isZero();
  }
  bool is_mirrored(Timestamp stamp) const {
    const auto has = [stamp](const Stretch& stretch) { return stretch.has(stamp); };
    return mirrored != std::any_of(reversed.begin(), reversed.end(), has);
  }
  SE3 apply(const SE3& T_body_lidar) const {
    return {SO3::rot_z(yaw) * T_body_lidar.so3(),
            T_body_lidar.translation() + Eigen::Vector3d(place.x(), place.y(), 0)};
  }
  void apply(LaserScan& scan) const {
    remove_own(scan);
    if (scan.size() > 1) {
      const double half = 0.5 * static_cast<double>(scan.size() - 1);
      const double middle = scan.angle_min + half * scan.angle_increment;
      scan.angle_increment *= aperture;
      scan.angle_min = middle - half * scan.angle_increment;
    }
    if (is_mirrored(scan.stamp)) {
      scan.angle_min = -scan.angle_min;
      scan.angle_increment = -scan.angle_increment;
    }
    scan.lidar.T_body_lidar = apply(scan.lidar.T_body_lidar);
  }
  /// Where beams run the other way, the last is the first.
  void remove_own(LaserScan& scan) const {
    if (own.size() != scan.size()) return;
    const bool other_way = is_mirrored(scan.stamp) != mirrored;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (own[other_way ? scan.size() - 1 - i : i].has(scan.ranges[i]))
        scan.ranges[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }
};

}  // namespace lamina
