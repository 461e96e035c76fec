// From labels of blocks to labels of pixels: only blocks at borders are looked at again.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/frontend/floor/plane_regions.hpp>

namespace lamina {

/// Labels of pixels: region index + 1, 0: none. Whole blocks that belong to a region are filled;
/// pixels of all other blocks go to the plane of a neighbouring block (two blocks around) that
/// fits them best, within `tolerance` px of disparity. Counts the pixels of every region.
void label_pixels(const DisparityImage& image, const DisparityGeometry& g, const BlockImage& blocks,
                  float tolerance, PlaneRegions& regions, std::vector<std::uint8_t>& pixel_labels);

/// Labels of blocks after the pixel pass: the region that holds at least half of a block's pixels.
std::vector<std::int16_t> block_majority(const std::vector<std::uint8_t>& pixel_labels, int width,
                                         int height, const BlockImage& blocks,
                                         std::span<const std::int16_t> block_labels);

}  // namespace lamina
