// Is a narrow region a surface, or the edge between two others?
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/frontend/depth/plane_regions.hpp>

namespace lamina {

/// Pixels [u0, u1) x [v0, v1).
struct PixelBox {
  int u0 = 0, u1 = 0, v0 = 0, v1 = 0;
};

/// A narrow region against its two neighbours. Where one surface ends over another, blocks that
/// hold both lie on a slanting plane of their own.
struct EdgeEvidence {
  int lines = 0;  ///< rows or columns looked at, across the region
  /// By which the region makes the fit better, in variances of a pixel. Which side of kLeast a line
  /// it is on is all that is found out: it is not the exact one of the best border.
  double gain = 0;
  /// Its border with each neighbour is free in every line, that of the neighbours with each other
  /// is one straight line: two borders a line gain a variance each by chance.
  static constexpr double kLeast = 2;
  bool is_edge() const { return lines > 0 && gain < kLeast * lines; }
};

/// The pixels of region k and a few beyond, explained in two ways: by itself between what lies on
/// either side, and by those two alone, parted by the best straight line (pixels beside that line
/// may be of either: sensors look half a pixel beside themselves). Some 32 lines are looked at:
/// rows of the image if `rows`, else columns. None where it has not the same neighbours on both
/// sides along most of it. `box` holds its pixels. `pixel_labels`: region index + 1, 0: none.
/// `variance`: of one pixel's disparity (px^2).
EdgeEvidence edge_evidence(const DisparityImage& image, const DisparityGeometry& g,
                           const std::vector<std::uint8_t>& pixel_labels,
                           const std::vector<PlaneRegion>& regions, std::size_t k,
                           const PixelBox& box, bool rows, double variance);

}  // namespace lamina
