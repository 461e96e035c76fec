// A scan made from depth: per beam the nearest thing that stops a robot, why, and how sure.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <lamina/models/planar_map.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Why a beam ends. Hole: ground was measured below the floor. Ledge: floor ends sharply and
/// nothing returns from behind. Edge of knowledge: floor is lost (grazing incidence, shadow,
/// range), nobody knows what follows. None: nothing found (outside the image).
enum class BeamCause : std::uint8_t { kNone, kObstacle, kHole, kLedge, kEdgeOfKnowledge };
/// "none", "obstacle", "hole", "ledge", "edge_of_knowledge".
const char* to_string(BeamCause cause);
inline bool is_negative(BeamCause c) { return c == BeamCause::kHole || c == BeamCause::kLedge; }

/// In the levelled body frame: origin on the floor under the robot, beam i along
/// angle_min + i * angle_increment about z, from x to y.
struct ObstacleScan {
  Timestamp stamp;
  double angle_min = 0, angle_increment = 0;  ///< rad
  double range_min = 0, range_max = 0;        ///< m
  /// m, horizontal distance from the body origin; NaN where cause is none. Beams that end at an
  /// edge of knowledge hold where knowledge ends: not a return, and not free beyond.
  std::vector<float> range;
  std::vector<BeamCause> cause;
  std::vector<float> sigma;   ///< m, 1-sigma of range
  std::vector<float> height;  ///< m, body z of the floor at the beam's end (0 for obstacles)
  /// m up to which floor was seen without a break; 0: none. Ground is known to be free to drive
  /// on up to min(range, floor_range), no further.
  std::vector<float> floor_range;

  std::size_t size() const { return range.size(); }
  double angle(std::size_t i) const { return angle_min + static_cast<double>(i) * angle_increment; }
  /// Index of the beam nearest to an angle (rad); -1 outside the scan.
  int beam_of(double angle) const;
  /// `beams` beams without an end.
  static ObstacleScan empty(Timestamp stamp, double angle_min, double angle_increment,
                            std::size_t beams, double range_max);

  /// A line of scans.csv: obstacles, holes and ledges are returns, all else is NaN (no return).
  /// With `knowledge_is_return` edges of knowledge are returns too, for planners that take every
  /// beam without a return for free space.
  LaserScan to_laser_scan(bool knowledge_is_return = false) const;
};

/// The least range per beam, with its cause, sigma and height; an edge of knowledge counts only
/// where neither scan has anything else. floor_range is the larger. Both scans must have the same
/// beams (a broken promise otherwise).
ObstacleScan combine(const ObstacleScan& a, const ObstacleScan& b);

/// One scan of depth and a real 2D lidar: the lidar's returns brought to the body frame by its
/// mounting, those between z = `min_height` and `max_height` (m, body z), least range per beam.
/// Beams cover both; where they overlap the increment is the depth scan's. Between lidar beams
/// (wider than ours) a return fills the beams its own width spans. Causes: obstacle.
ObstacleScan merge_scans(const ObstacleScan& depth, const LaserScan& lidar,
                         double min_height = 0.02, double max_height = 1e9);

/// Rims of holes, ledges (negative) and ends of knowledge, as points at T_map_body.
std::vector<EdgePoint> edge_points(const ObstacleScan& scan, const SE3& T_map_body = SE3());

}  // namespace lamina
