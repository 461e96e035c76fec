// A likelihood grid of scan points with a max-pyramid, and branch-and-bound search over it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include <lamina/frontend/motion/planar.hpp>

namespace lamina {

/// How well points fit a map, per cell: 255 at a map point, falling with the distance as
/// exp(-d^2 / (2 s^2)). Level h of the pyramid holds at (x, y) the maximum over the square of 2^h
/// cells that starts there, so that one look-up bounds a whole window of shifts. [Hess2016]
class LikelihoodGrid {
 public:
  /// `resolution` m a cell; `smoothing` s in m; levels 0 to `levels` - 1.
  LikelihoodGrid(const std::vector<Eigen::Vector2d>& points, double resolution, double smoothing,
                 int levels);

  double resolution() const { return resolution_; }
  int levels() const { return static_cast<int>(levels_.size()); }
  /// 0 to 255; 0 outside.
  int at(int level, int x, int y) const {
    // A window that starts left of or below the grid may still reach into it.
    const int reach = (1 << level) - 1;
    x += reach;
    y += reach;
    const Level& l = levels_[static_cast<std::size_t>(level)];
    if (x < 0 || y < 0 || x >= l.width || y >= l.height) return 0;
    return l.cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(l.width) +
                   static_cast<std::size_t>(x)];
  }
  int cell_x(double x) const {
    return static_cast<int>(std::floor((x - origin_.x()) / resolution_));
  }
  int cell_y(double y) const {
    return static_cast<int>(std::floor((y - origin_.y()) / resolution_));
  }
  std::size_t bytes() const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<std::uint8_t> cells;
  };
  void stamp(const std::vector<Eigen::Vector2d>& points, double smoothing);
  void add_level();

  double resolution_;
  Eigen::Vector2d origin_;
  std::vector<Level> levels_;
};

/// Where to look: start +- window.
struct SearchWindow {
  double translation = 1.0;  ///< m, to each side in x and y
  double rotation = 0.3;     ///< rad, to each side
  /// When set: nothing within `exclude_translation` and `exclude_rotation` of this pose counts.
  std::optional<PlanarPose> exclude;
  double exclude_translation = 0.5, exclude_rotation = 0.2;
};

struct CorrelativeMatch {
  PlanarPose T_map_scan;
  double score = 0;  ///< mean likelihood of the points, 0 to 1
};

/// Points of one kind with the map of that kind; each counts `weight` times, 1 to 255.
struct SearchLayer {
  const LikelihoodGrid* grid = nullptr;  ///< of the same resolution and levels in all layers
  std::vector<Eigen::Vector2d> points_scan;
  int weight = 1;
};

/// The best pose in the window whose score exceeds `min_score`, over all shifts by whole cells and
/// all turns by steps that move the farthest point by one cell: exact on that lattice.
/// [Olson2009], branch and bound [Hess2016]. nullopt when nothing does. At most 30,000 points.
std::optional<CorrelativeMatch> search_correlative(const std::vector<SearchLayer>& layers,
                                                   const PlanarPose& start,
                                                   const SearchWindow& window, double min_score);

/// One layer.
std::optional<CorrelativeMatch> search_correlative(const LikelihoodGrid& grid,
                                                   const std::vector<Eigen::Vector2d>& points_scan,
                                                   const PlanarPose& start,
                                                   const SearchWindow& window, double min_score);

}  // namespace lamina
