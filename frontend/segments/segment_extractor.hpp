// Split-and-merge: a 2D scan to straight segments and loose points.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <lamina/frontend/segments/arc_fit.hpp>
#include <lamina/frontend/segments/line_fit.hpp>
#include <lamina/frontend/segments/scan_returns.hpp>
#include <lamina/frontend/segments/segment_options.hpp>
#include <lamina/models/scan_segment.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// What a scan gave. Beams that had no return are in neither list.
struct Segments {
  std::vector<ScanSegment> segments;  ///< by first beam, in the scanner frame
  std::vector<int> loose_beams;       ///< returns that belong to no segment, ascending
  int missing = 0;                    ///< beams without a usable return
  int curved = 0;                     ///< pieces left out because an arc explains them better
  double noise_scale = 1;             ///< how much rougher the scan is than its noise model says
};

/// Straight pieces of a scan ([Nguyen2007] compares the methods; this is split-and-merge on
/// least-squares costs rather than on the farthest point):
///  1. break where neighbours are too far apart for one surface;
///  2. split a run at the place where two lines gain most chi-squared over one, while that is
///     significant (O(1) a place, by prefix sums in inverse range);
///  3. merge neighbours, across shadows and the 0/360 degree seam too, while that loses nothing
///     significant;
///  4. leave out what arcs explain better, then fit what is left by maximum likelihood.
/// Thresholds are chi-squared of the lidar's noise, so they follow range, incidence and sigma.
class SegmentExtractor {
 public:
  /// Throws lamina::Error for options that have problems().
  explicit SegmentExtractor(SegmentOptions options = {});
  /// Any scan is legal: empty, all missing, of one beam, with a negative increment.
  Segments extract(const LaserScan& scan);
  const SegmentOptions& options() const { return options_; }

 private:
  /// Returns of one line: parts [begin, end) in beam order, more than one after a bridge.
  struct Run {
    std::vector<std::pair<int, int>> parts;
    InverseRangeSums sums;
    /// Covariance of (rho, theta), on top of the noise's, for not knowing at which beam the run
    /// begins and ends where it meets another.
    Eigen::Matrix2d uncertain_begin = Eigen::Matrix2d::Zero(),
                    uncertain_end = Eigen::Matrix2d::Zero();
    int begin() const { return parts.front().first; }
    int end() const { return parts.back().second; }
  };

  double threshold(int count) const;
  double merge_loss(const Run& a, const Run& b) const;
  bool contiguous(const Run& a, const Run& b) const;
  int best_split(int begin, int end, const InverseRangeSums& before, const InverseRangeSums& after,
                 double& gain) const;
  void split(int begin, int end);
  void merge_neighbours();
  void merge_seam();
  // Pieces of surfaces that bend (segment_curves.cpp).
  void drop_curved(Segments& out);
  std::vector<char> chords() const;
  void uncertain_straight(std::vector<char>& curved) const;
  std::optional<Arc> arc_through(std::size_t first, std::size_t last) const;
  bool arc_is_possible(std::size_t first, std::size_t last) const;
  bool arc_wins(std::size_t first, std::size_t last) const;
  void drop_debris();
  void refine_boundaries();
  struct Sides {
    InverseRangeSums a, b;
    double cost() const { return a.cost() + b.cost(); }
  };
  Sides divided_at(const Run& a, const Run& b, int k) const;
  void divide_at(Run& a, Run& b, int k) const;
  static int lowest_boundary(const Run& a) { return a.parts.back().first + 2; }
  static int highest_boundary(const Run& b) { return b.parts.front().second - 2; }
  void refine_boundary(Run& a, Run& b) const;
  bool meet_at_corner(Run& a, Run& b) const;
  void uncertain_boundary(Run& a, Run& b) const;
  Eigen::Matrix2d hidden_corner(const Run& run) const;
  void bridge();
  bool can_bridge(const Run& a, const Run& b) const;
  bool seen_through(const InverseRangeSums& both, int from, int to) const;
  bool acceptable(const ScanSegment& segment) const;
  void emit(const Run& run, Segments& out);
  static void append(Run& a, const Run& b);

  SegmentOptions options_;
  ScanPoints points_;
  double floor_ratio_ = 0;  ///< shared error over noise, squared
  double increment_ = 0;
  std::vector<Run> runs_;
  std::vector<int> indices_, rejected_;
  std::vector<char> used_;
};

}  // namespace lamina
