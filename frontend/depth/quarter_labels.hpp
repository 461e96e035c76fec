// Labels of quarters of blocks: where planes end, finer than blocks tell.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <lamina/frontend/depth/blocks.hpp>
#include <lamina/frontend/depth/floor_result.hpp>

namespace lamina {

/// Two by two quarters a block, cut at half its size (px, down to the whole).
struct QuarterLabels {
  int block_px = 8, columns = 0, rows = 0;  ///< columns and rows of quarters
  std::vector<std::int16_t> labels;         ///< of regions, row by row; -1: none

  std::int16_t& at(int c, int r) { return labels[index(c, r)]; }
  std::int16_t at(int c, int r) const { return labels[index(c, r)]; }
  std::size_t index(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(c);
  }
  /// The first pixel of column (or row) i.
  int first_px(int i) const { return i / 2 * block_px + i % 2 * (block_px / 2); }
};

/// Borders between planes lie in blocks that both share: a quarter is of the plane that has at
/// least half of its measured pixels, and a quarter of all. Quarters of blocks amid their own kind
/// are that kind's. `block_labels`: the region with at least half of a block's pixels, -1: none;
/// `pixel_labels`: region + 1, 0: none.
QuarterLabels quarter_labels(const DisparityImage& image, const BlockImage& blocks,
                             std::span<const std::int16_t> block_labels,
                             std::span<const std::uint8_t> pixel_labels);

/// Takes away what is but one quarter wide: along the foot of a wall, pixels of the floor lie on
/// the wall's plane, too, and past its end as well. Labels that have hardly anything wider stay.
void prune_thin_borders(QuarterLabels& quarters);

/// Takes quarters away that span 30 cm of an upright plane or more, as those of walls do that are
/// seen at a grazing angle from far away: gaps as wide as doors do not show in them. Planes that
/// would lose half of their quarters stay as they are: what is far as a whole is known no better.
/// `planes`: with their slopes and disparities; label k is of the k-th.
void drop_coarse(QuarterLabels& quarters, std::span<const ExtractedPlane> planes,
                 const DisparityGeometry& geometry);

}  // namespace lamina
