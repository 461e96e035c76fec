// A 2D laser scanner in any mounting.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/sensors/laser_scan.hpp>
#include <lamina/sim/caster.hpp>

namespace lamina::sim {

/// Geometry of one revolution.
struct LidarGeometry {
  double angle_min = -2.35619449019234493;          ///< rad
  double angle_increment = 0.00872664625997164788;  ///< rad; may be negative
  int beams = 541;
  double range_min = 0.05, range_max = 30;  ///< m
};

/// Effects of a real scanner; every one has its switch.
struct LidarEffects {
  bool noise = true;    ///< range noise, the model's range_sigma
  bool grazing = true;  ///< no return beyond grazing_deg of incidence
  bool mixed = true;    ///< at range jumps a beam may fall between the two surfaces
  double grazing_deg = 88;
  double dropout = 0.002;          ///< probability of no return
  double mixed_probability = 0.3;  ///< of one of the two beams at a jump
  double mixed_jump = 0.1;         ///< m between neighbours that count as a jump

  static LidarEffects none();
};

/// What really is along each beam: m and Caster's surface number; range 0 and surface -1 where
/// there is nothing within the sensor's reach.
struct ScanTruth {
  std::vector<double> ranges;
  std::vector<std::int32_t> surfaces;
};

/// Cuts the scene's faces with the scan plane: each face costs one segment, each beam one division.
class LidarSimulator {
 public:
  LidarSimulator(const Caster& caster, const LidarModel& model, const LidarGeometry& geometry,
                 const LidarEffects& effects, std::uint64_t seed);
  ScanTruth truth(const SE3& T_map_lidar) const;
  /// Of a scanner that moves while its beam goes round: poses at equal times from the first beam to
  /// the last, each for its share of the beams.
  ScanTruth truth(const std::vector<SE3>& T_map_lidar) const;
  LaserScan measure(const ScanTruth& truth, const SE3& T_map_lidar, Timestamp stamp,
                    std::uint64_t scan_index) const;
  LaserScan render(const SE3& T_map_lidar, Timestamp stamp, std::uint64_t scan_index) const {
    return measure(truth(T_map_lidar), T_map_lidar, stamp, scan_index);
  }

 private:
  void cut_face(const Face& face, std::int32_t surface, const SE3& T_lidar_map,
                ScanTruth& out) const;
  void cast_rest(const SE3& T_map_lidar, ScanTruth& out) const;

  const Caster* caster_;
  LidarModel model_;
  LidarGeometry geometry_;
  LidarEffects effects_;
  std::uint64_t seed_;
  std::vector<Eigen::Vector2d> directions_;  ///< of the beams
};

}  // namespace lamina::sim
