// Outlines of planes from labels of blocks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace lamina {

/// The longest outer outline of every label, as block corners (column, row), simplified to
/// `tolerance` blocks. Sides follow block borders, so outlines are concave where the plane is.
/// Result i belongs to label i; empty where the label has no block.
std::vector<std::vector<Eigen::Vector2d>> trace_outlines(std::span<const std::int16_t> labels,
                                                         int columns, int rows, int label_count,
                                                         double tolerance);

}  // namespace lamina
