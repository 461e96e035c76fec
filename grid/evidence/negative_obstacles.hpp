// Rims of holes over many frames: what closer or later looks take back is dropped.
#pragma once

#include <vector>

#include <lamina/grid/evidence/looks.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/obstacle_scan.hpp>

namespace lamina {

/// A rim seen from afar is often where the sensor loses the floor, not where the floor ends; a pit
/// may be covered by a plank later. Both show as floor seen beyond the rim. A rim's cell is dropped
/// when three frames or more saw floor pass it and either the nearest of them was nearer than any
/// that saw the rim, or all of them came after the last that did.
class RimVotes {
 public:
  /// `folder`: where the views are kept on disk.
  explicit RimVotes(const std::filesystem::path& folder = std::filesystem::temp_directory_path())
      : views_(folder) {}
  /// `T_body_levelled`: the scan's frame in the body.
  void add(const ObstacleScan& scan, const SE3& T_body_levelled);
  /// Rims at the places the path gives them, at most one for each cell of `resolution` m: the one
  /// with the least sigma; those whose sigma is above 0.05 m are ends of knowledge. Ascending by
  /// cell.
  std::vector<EdgePoint> rims(const Trajectory& trajectory, double resolution) const;

  /// All that was added (archived SeenRims), for sessions, and back.
  const Spool& seen() const { return views_; }
  Spool& seen() { return views_; }
  void take(const std::vector<SeenRims>& seen);

 private:
  Spool views_;
};

}  // namespace lamina
