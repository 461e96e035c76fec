// Occupancy from 2D scans: log-odds along rays.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <lamina/grid/tiled_grid.hpp>
#include <lamina/grid/touched_cells.hpp>
#include <lamina/models/lie/se3.hpp>

namespace lamina {

struct OccupancyOptions {
  double resolution = 0.05;    ///< m
  double log_odds_hit = 0.9;   ///< p = 0.71 a return: two returns pass the threshold of map_server
  double log_odds_miss = 0.4;  ///< p = 0.40 a crossing: a third of them clears a wrong return
  double log_odds_limit = 5;   ///< both ways: a changed world is believed after a dozen scans
  double min_height = 0.02;    ///< m, band of the robot over its ground; where a ray leaves it,
  double max_height = 3.0;     ///< m, the ray says nothing of the cell below it
  double max_range = 60;       ///< m
  /// One line for each setting that cannot be.
  std::vector<std::string> problems() const;
};

/// A beam for the grid, in the frame of its scan.
struct OccupancyBeam {
  Eigen::Vector2d end_scan = Eigen::Vector2d::Zero();  ///< m, in the scan plane
  double sigma = 0.01;                                 ///< m, along the ray
  bool obstacle = true;  ///< false: the ray ends without one (end of knowledge); it clears only
  bool returned = true;  ///< false: nothing came back; it clears up to what is solid
};

struct OccupancyCell {
  float log_odds = std::numeric_limits<float>::quiet_NaN();  ///< NaN: no scan said anything of it
  std::uint16_t ends = 0, passes = 0;  ///< scans that marked it; whose rays went on 0.3 m behind it
  bool seen() const { return log_odds == log_odds; }
};

/// [Moravec1985] in log-odds. Each ray clears the cells it crosses up to three sigma before its end
/// and marks those its end may lie in. A beam that did not return is left out by the caller, or
/// given as long as it is known to have met nothing. Rays are cut to the height band of the robot,
/// so that a tilted scanner marks floor neither occupied nor, beyond where the ray left the band,
/// free.
class OccupancyGrid {
 public:
  explicit OccupancyGrid(const OccupancyOptions& options = {});

  /// `T_map_scan`: the scan lies in its x-y plane. Cells get one update a scan at most, a mark
  /// before a clearing. `ground`: map z (m) of the ground that the height band is over.
  /// `first_grid`: one that holds these scans already. A ray that went on for 0.3 m or more behind
  /// a cell that is solid there, while neither neighbour in its scan ends near it, is a stray: it
  /// clears up to that cell, and marks only where the first grid has a solid cell beside its end.
  void add(const SE3& T_map_scan, const std::vector<OccupancyBeam>& beams, double ground = 0,
           const OccupancyGrid* first_grid = nullptr);

  /// add() in two: what a scan says of which cells, and taking that. Threads may ask for several
  /// scans at once while nothing is taken; `cells` keeps buffers alone, each thread has its own.
  std::vector<CellTouch> touches(const SE3& T_map_scan, const std::vector<OccupancyBeam>& beams,
                                 double ground, const OccupancyGrid* first_grid,
                                 TouchedCells& cells) const;
  void take(const std::vector<CellTouch>& touches);

  /// Nearly all rays that came to it ended there: occupied in the end, four scans at least marked
  /// it, and rays of half as many at most went on behind. Glass, jambs and what has left are not.
  bool solid(const CellIndex& cell) const;
  /// Share of all marks that lie in cells which more rays went on behind than ended in: of returns
  /// from what moved, was never there, or stands elsewhere by another part of the scans. 0 of none.
  double seen_through() const;
  /// Whether a line (map frame, m) crosses a solid cell.
  bool solid_between(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;
  /// Takes back what marked a cell: free, or as if no ray had been there.
  void make_free(const CellIndex& cell);
  void forget(const CellIndex& cell);

  /// Probability of being occupied in [0, 1]; NaN where no ray has been.
  float probability(const CellIndex& cell) const;
  GridGeometry bounds() const;
  /// A row of probabilities over `geometry`, row 0 at the largest y; NaN where no ray has been.
  void image_row(const GridGeometry& geometry, int row, float* out) const;
  const TiledGrid<OccupancyCell>& cells() const { return cells_; }
  void clear() { cells_.clear(); }

 private:
  void trace(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
             std::vector<CellIndex>& crossed) const;
  std::size_t went_on_behind(const std::vector<CellIndex>& ray, const Eigen::Vector2d& end) const;
  double reach(const std::vector<OccupancyBeam>& beams) const;
  OccupancyOptions options_;
  TiledGrid<OccupancyCell> cells_;
  TouchedCells touched_;  // of one scan
};

}  // namespace lamina
