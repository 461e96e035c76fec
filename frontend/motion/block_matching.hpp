// Blocks of one depth image against a key frame's: projective association, point to plane.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/motion/depth_blocks.hpp>
#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// What still counts as the same surface.
struct BlockGate {
  float distance;          ///< m off the plane, or
  float sigmas;            ///< as many of both blocks' noise
  float beside;            ///< squared share of the depth that the points may be apart
  float cosine;            ///< between the normals
  float surface_variance;  ///< m^2, of surfaces within blocks
  float facing = 0.14F;    ///< see accumulate()
};

/// Normal equations of T_key_current (right tangent, camera frame), and what the blocks say.
struct BlockSums {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double squares = 0;                    ///< m^2, distances off the planes
  double agreement = 0;                  ///< sum of robust weights, 1 for a block that fits exactly
  Matrix6d spurious = Matrix6d::Zero();  ///< the part of H that noise of the normals makes
  int used = 0, tried = 0;
};

/// A motion that few surfaces hold: `tangent`, a metre of it or its like at the lever, and the
/// covector that measures it.
struct HardDirection {
  Vector6d tangent, covector;
};

/// Adds every stride-th block of `current` that falls on one of `key` and passes the gate, with
/// Geman-McClure-like weights: a quarter at half the gate. Blocks within `facing` (sine) of being
/// parallel to a hard direction say nothing of it: walls that run along it are many, and a bend of
/// the image, which moves with the camera, makes them say that it stands still.
void accumulate(const DepthBlocks& key, const DepthBlocks& current, const SE3& T_key_current,
                int stride, const BlockGate& gate, const std::vector<HardDirection>& hard,
                BlockSums& sums);

/// Directions that have less than `share` of the information of the best, angles brought to metres
/// by `lever`.
std::vector<HardDirection> hard_directions(const Matrix6d& H, double lever, double share);

/// By how much the mean robust weight of the blocks at one pose (T_key_current) is above that at
/// another, of those that meet a block of `key` at both: what leaves the view counts for neither.
/// What meets one without a normal (nothing measured, an edge) neither, unless it fits not, then.
/// The gate is `sigmas` of the noise alone. 0 where they are less than 15 % of all.
double gained_agreement(const DepthBlocks& key, const DepthBlocks& current, const SE3& from,
                        const SE3& to, int stride, const BlockGate& gate,
                        bool empty_fits_not = false);

/// Mean robust weight of the blocks at a pose, of those that meet a block of `key`, with a
/// normal or not (`empty_fits_not`); 0 where none does.
double agreement_in_view(const DepthBlocks& key, const DepthBlocks& current,
                         const SE3& T_key_current, int stride, const BlockGate& gate);

/// Keeps what surfaces hold: H and b without directions in which H - `doubtful` is below `limit`
/// (1/m^2), angles brought to metres by `lever`. Returns those that are missing, as tangents.
std::vector<Vector6d> without_weak_directions(Matrix6d& H, Vector6d& b, const Matrix6d& doubtful,
                                              double lever, double limit);

}  // namespace lamina
