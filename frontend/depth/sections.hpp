// The region of interest and its sub-sections, nearest first.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include <lamina/frontend/depth/floor_options.hpp>

namespace lamina {

/// Splits the ROI (levelled body frame: x in [0, length], |y| <= width / 2, z from
/// -roi_depth_below to height) into nx x ny cuboids. The sensor bisects the width.
class SectionGrid {
 public:
  explicit SectionGrid(const FloorOptions& options);
  int count() const { return nx_ * ny_; }
  int nx() const { return nx_; }
  int ny() const { return ny_; }
  /// The section a point belongs to; -1 outside the ROI.
  int section_of(const Eigen::Vector3d& point_body) const;
  /// All sections in execution order: by distance of their centre from the body's origin, ties by
  /// index. Near floor is known before far floor is looked at.
  const std::vector<int>& by_priority() const { return order_; }
  std::pair<int, int> coordinates(int section) const { return {section / ny_, section % ny_}; }

 private:
  int nx_, ny_;
  double length_, width_, height_, below_;
  std::vector<int> order_;
};

}  // namespace lamina
