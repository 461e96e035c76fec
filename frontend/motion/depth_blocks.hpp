// A depth image as oriented points of small pixel blocks: what depth odometry works on.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <vector>

#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

struct DepthBlockOptions {
  /// Side of a block: 4 px of a Kinect (525 px focal length); fewer for coarser cameras.
  double block_angle = 4.0 / 525;  ///< rad
  double max_slope = 5.7;  ///< tangent of the incidence beyond which a block counts as an edge
  int reach = 2;           ///< blocks to each side over which a normal is fitted
  double edge_sigmas = 6;  ///< a block whose disparities spread more holds an edge and is left out
  double flat_sigmas = 3;  ///< rms of the normal's fit (in sigmas of a block) that is still a plane
  double max_depth = 12;   ///< m
};

/// A block's mean point and the plane through it and its neighbours. Camera frame, m.
struct DepthBlock {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, towards the camera; zero: none
  float sigma = 0;  ///< m, 1-sigma of the point along its normal; 0: no point
  float tilt = 0;   ///< 1-sigma of the normal: it errs by tilt_axes() times two such numbers
  bool valid() const { return sigma > 0; }
  bool oriented() const { return normal.z() < 0; }
};

struct DepthBlocks {
  int width = 0, height = 0;              ///< blocks
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< of the image of blocks: block (u, v) has centre u, v
  std::vector<DepthBlock> blocks;         ///< row-major
  const DepthBlock& at(int u, int v) const {
    return blocks[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(u)];
  }
  bool any_oriented() const {
    return std::any_of(blocks.begin(), blocks.end(), [](const auto& b) { return b.oriented(); });
  }
};

/// The block of `blocks` that a point falls on (camera frame of `blocks`, m); null: beside the
/// image, or nearer than 0.1 m. What it points at may be without a measurement.
inline const DepthBlock* block_under(const DepthBlocks& blocks, const Eigen::Vector3f& point) {
  constexpr float kNearest = 0.1F;
  if (point.z() < kNearest) return nullptr;
  const float u =
      static_cast<float>(blocks.fx) * point.x() / point.z() + static_cast<float>(blocks.cx + 0.5);
  const float v =
      static_cast<float>(blocks.fy) * point.y() / point.z() + static_cast<float>(blocks.cy + 0.5);
  const bool inside = u >= 0 && v >= 0 && u < static_cast<float>(blocks.width) &&
                      v < static_cast<float>(blocks.height);
  return inside ? &blocks.at(static_cast<int>(u), static_cast<int>(v)) : nullptr;
}

/// How a block's normal n turns with the slopes a and b of its disparity, in the units of tilt:
/// n = -(a, b, d - a x - b y) / |...|, and |...| = f b / rho for a plane rho from the camera, so
/// dn = -tilt (1 - n n^T) ((1, 0, -x), (0, 1, -y)), (x, y) its place in the normalised image. Walls
/// along the view hardly turn about the axis across it.
inline std::array<Eigen::Vector3f, 2> tilt_axes(const DepthBlock& block) {
  const Eigen::Vector3f& n = block.normal;
  const float x = block.point.x() / block.point.z(), y = block.point.y() / block.point.z();
  const Eigen::Vector3f a(1, 0, -x), b(0, 1, -y);
  return {a - n * n.dot(a), b - n * n.dot(b)};
}

template <class A>
void fields(A& a, DepthBlock& v) {
  a(v.point, v.normal, v.sigma, v.tilt);
}
template <class A>
void fields(A& a, DepthBlocks& v) {
  a(v.width, v.height, v.fx, v.fy, v.cx, v.cy, v.blocks);
}

/// Means are taken, and planes are fitted, in disparity, where structured light and stereo have
/// constant noise and a plane is linear: d = a x + b y + c over normalised image coordinates gives
/// the normal -(a, b, c)/|(a, b, c)|.
DepthBlocks depth_blocks(const DepthFrame& frame, const DepthBlockOptions& options = {});

/// m, of every seventh block that has a point; 1 where none has.
double median_depth(const DepthBlocks& blocks);

}  // namespace lamina
