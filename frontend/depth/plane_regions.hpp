// Whole planes over the block image: growth from seeds, merging, and the fight for borders.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <lamina/frontend/depth/blocks.hpp>
#include <lamina/frontend/depth/recursive_ransac.hpp>

namespace lamina {

struct PlaneRegion {
  DisparityPlane plane = DisparityPlane::Zero();
  DisparitySums sums;
  int blocks = 0;
  std::int64_t pixels = 0;  ///< after the pixel pass; before it those of its blocks
};

/// Labels of blocks and the planes they belong to. A block joins a plane when its mean lies within
/// `sigmas` standard errors (its own, the plane's prediction and the shared floor) and its pixels'
/// slope agrees. All decisions depend on the input alone: no randomness, no threads.
class PlaneRegions {
 public:
  void start(const BlockImage& blocks, const DisparityGeometry& g, const BlockNoise& noise,
             double sigmas);
  std::span<const std::int16_t> labels() const { return labels_; }
  const std::vector<PlaneRegion>& regions() const { return regions_; }
  std::vector<PlaneRegion>& regions() { return regions_; }

  /// Floods from the seeds over all free blocks, refitting as it grows. Returns the new region's
  /// index; -1 (and the seeds stay free) when it stays below `min_pixels`.
  int grow(std::span<const int> seeds, const DisparityPlane& plane, double min_pixels);
  /// Joins regions whose planes differ by no more than noise where either has its pixels. Regions
  /// apart from each other (a wall behind a pillar) are held to two sigmas of their difference,
  /// carried over the gap. Level ones (normal within 20 degrees of `up_camera`) with a lower region
  /// between them stay two: one image cannot say how level two platforms are, all together
  /// can; not so the largest region, a floor that goes on beyond a pit. Best pairs first.
  void merge(const Eigen::Vector3d& up_camera);
  /// Blocks between regions go to the plane that fits best; free ones that fit join. Then refits.
  void settle_borders(int passes);
  /// Drops regions below `min_pixels`, those whose normal is unsure by more than two degrees and
  /// those scattered in thin strips (a row of posts), and sorts the rest, largest first (ties: by
  /// index).
  void keep_largest(double min_pixels);
  /// Drops the regions that are not wanted. Returns old index -> new index, -1: dropped.
  std::vector<std::int16_t> keep(const std::vector<bool>& wanted);

 private:
  struct Test {
    Test(const Eigen::Vector3f& p, const Eigen::Matrix3f& C)
        : plane(p), covariance(C), jitter(jitter_variance(p.x(), p.y())) {}
    Eigen::Vector3f plane;
    Eigen::Matrix3f covariance;
    float jitter;  ///< px^2, of one pixel
  };
  /// Where a region's pixels are, and what merging asks of its plane.
  struct Shape {
    double u, v, uu, uv, vv;     ///< middle and covariance of the pixels
    bool level;                  ///< within 20 degrees
    Eigen::Matrix3d covariance;  ///< of the plane

    /// Squared distance of a place from the middle, in the spread of the pixels that way.
    double distance_in_sizes2(double to_u, double to_v) const;
  };
  struct Run {
    int begin, end, parent;  ///< columns [begin, end) of a row; a run of the same piece
  };
  bool fits(const Block& block, const Test& test) const;
  Test test_of(const DisparityPlane& plane, const DisparitySums& sums) const;
  void flood(int label, DisparitySums& sums, DisparityPlane& plane);
  bool refit_members(int label, DisparitySums& sums, DisparityPlane& plane);
  bool hangs_together(int label);
  void connected(int start, std::vector<std::uint8_t>& waiting);
  void split_off_parts(int label, double min_pixels);
  double joined_cost(const PlaneRegion& a, const PlaneRegion& b) const;
  double carried_cost(std::size_t a, std::size_t b) const;
  bool within_reach(std::size_t a, std::size_t b) const;
  bool two_platforms(std::size_t a, std::size_t b) const;
  double least_cost(std::size_t a, std::size_t b, bool neighbours) const;
  double apart_cost(std::size_t a, std::size_t b, double joined) const;
  void start_merging(const Eigen::Vector3d& up_camera);
  void join(std::size_t first, std::size_t second);
  bool seen_through(std::size_t a, std::size_t b) const;
  Shape shape_of(const PlaneRegion& region) const;
  std::vector<std::uint8_t> neighbourhood() const;
  void find_rows();
  bool is_scattered(int label) const;
  bool sure_normal(const PlaneRegion& region) const;
  void relabel(std::span<const std::int16_t> renamed);
  void recount();
  bool settle_block(int column, int row, std::span<const Test> tests);

  const BlockImage* blocks_ = nullptr;
  DisparityGeometry geometry_;
  BlockNoise noise_;
  float gate2_ = 16;          ///< sigmas squared
  float noise_of_whole_ = 0;  ///< px^2, of the mean of a whole block
  float bend_ = 0;            ///< px^2 that a block's slope may add to its pixels' residuals
  std::vector<std::int16_t> labels_;
  std::vector<PlaneRegion> regions_;
  std::vector<int> queue_, members_;
  std::vector<int> column_;  ///< of every block
  std::vector<std::uint8_t> waiting_;
  std::vector<Run> runs_;
  std::vector<std::pair<int, int>> extent_;  ///< of the regions: first row, one beyond the last
  Eigen::Vector3d up_camera_ = Eigen::Vector3d::Zero();
  double most_pixels_ = 0;  ///< of a region, while merging
  std::vector<std::int16_t>
      successors_;             ///< of the regions, while merging: labels follow at its end
  std::vector<Shape> shapes_;  ///< of the regions, while merging
};

}  // namespace lamina
