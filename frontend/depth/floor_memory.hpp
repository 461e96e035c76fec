// Floor remembered between frames: surfels and cell evidence, sharpened as the sensor comes nearer.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <lamina/frontend/depth/low_obstacles.hpp>

namespace lamina {

/// Ground cells and surfels in the odometry frame. Every frame's independent evidence adds up; what
/// pixels of a frame share averages over frames only as the views differ: a view from the same
/// place repeats the same distortion, so the shared variance of a cell is that of its best view,
/// divided by the number of places (`view_step` apart) it was seen from.
class FloorMemory {
 public:
  explicit FloorMemory(const FloorOptions& options = {}) : options_(options) {}

  /// Adds a frame's evidence. `T_odom_body`: the levelled body of that frame.
  void add(const FloorResult& result, const SE3& T_odom_body);
  /// Raised and sunk patches around the last pose, from all frames; cells index the grid about
  /// grid_origin(), centres are in the last body frame.
  std::vector<LowObstacle> low_obstacles() const;
  /// Surfels in the odometry frame: of those met at one place, the surest, sharpened by the rest.
  std::vector<Surfel> surfels_odom() const;
  std::size_t size() const { return cells_.size(); }
  /// Forgets what lies further than `radius` m from the last pose.
  void forget_beyond(double radius);

 private:
  using Key = std::pair<std::int32_t, std::int32_t>;
  struct Cell {
    double information = 0, weighted_height = 0;
    double least_shared = 1e9;
    double range = 0;
    int views = 0;
    Eigen::Vector2d last_view = Eigen::Vector2d::Zero();
  };
  struct Disc {
    Surfel surfel;
    double information = 0;  ///< 1/m^2 along the normal, all frames
    void fuse(const Surfel& s);
  };
  void add_heights(const FloorSurface& surface);
  Key key_of(const Eigen::Vector2d& xy, double cell) const;

  FloorOptions options_;
  SE3 T_odom_body_;
  std::map<Key, Cell> cells_;
  std::map<Key, Disc> discs_;
};

}  // namespace lamina
