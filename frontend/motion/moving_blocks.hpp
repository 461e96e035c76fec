// What moved between two depth images: surfaces that stand where the other image saw through.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/frontend/motion/depth_blocks.hpp>
#include <lamina/models/lie/se3.hpp>

namespace lamina {

enum class SeenFrom { kUnknown, kBefore, kLike };

/// Where a point with its noise (camera frame of `back`, m) is to what `back` measured around its
/// ray: before all of it, by a tenth of the depth and four sigmas; as far as it; or anything else
/// (behind it, at an edge, out of sight).
SeenFrom seen_from(const DepthBlocks& back, const Eigen::Vector3f& point, float sigma);

/// One mark a block of `front`: 1 where it stands before all that `back` measured around the same
/// ray, by a tenth of the depth and four sigmas, and over the surface around such a place (without
/// steps or bends: a person, not the floor they stand on). Two images of what stands still show
/// nothing the like, whatever covers what, if T_back_front is right; less than half a percent of
/// such places is taken for noise, and nothing is marked. A mark says nothing of which of two
/// things moved. Empty marks: nothing moved.
std::vector<std::uint8_t> moving_blocks(const DepthBlocks& back, const DepthBlocks& front,
                                        const SE3& T_back_front);

/// Takes the marked blocks' points and normals away. Returns the share of oriented blocks.
double drop_blocks(DepthBlocks& blocks, const std::vector<std::uint8_t>& marks);

}  // namespace lamina
