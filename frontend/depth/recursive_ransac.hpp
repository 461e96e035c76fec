// RANSAC on blocks: one step of the recursion that takes a section's planes one after the other.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lamina/frontend/depth/blocks.hpp>

namespace lamina {

/// Variances of a frame's disparity, in px^2: the sensor's model times what the frame shows.
struct BlockNoise {
  double pixel = 0;      ///< of one pixel, quantisation included
  double per_pixel = 0;  ///< variance of a mean of n pixels is per_pixel / n: correlation included
  double shared = 0;     ///< of what a whole plane shares: model, or more where the frame shows it
  double local = 0;      ///< of what a patch of some cells shares beside the floor around it: model

  double of_mean(double n) const { return per_pixel / n + shared; }
};

/// Which normals are wanted: those within a cone about the prior. An empty one wants all.
struct NormalPrior {
  Eigen::Vector3d normal_camera = Eigen::Vector3d::Zero();
  double cos_cone = -1;
  bool admits(const Plane& plane) const {
    return cos_cone <= -1 || plane.normal().dot(normal_camera) >= cos_cone;
  }
};

/// A small generator with a fixed sequence on every machine (SplitMix64 [Steele2014]).
class Sampler {
 public:
  explicit Sampler(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  int below(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }

 private:
  std::uint64_t state_;
};

struct BlockPlane {
  DisparityPlane plane = DisparityPlane::Zero();
  std::vector<int> inliers;  ///< block indices
  double pixels = 0;
};

/// The plane with the most pixels among `candidates` (indices of flat blocks), refitted on its
/// inliers. A hypothesis is the fit of a sampled block with its neighbours, which is worth many
/// three-point samples; a block is an inlier when its mean lies within `sigmas` standard errors.
/// nullopt when no hypothesis admitted by the prior gathers `min_pixels`.
class BlockRansac {
 public:
  BlockRansac(const BlockImage& blocks, const DisparityGeometry& g, const BlockNoise& noise)
      : blocks_(blocks), geometry_(g), noise_(noise) {}
  std::optional<BlockPlane> best_plane(std::span<const int> candidates,
                                       std::span<const std::int16_t> taken,
                                       const NormalPrior& prior, double sigmas, int hypotheses,
                                       double min_pixels, Sampler& sampler);

 private:
  std::optional<DisparityPlane> hypothesis(int block, std::span<const std::int16_t> taken) const;
  void gather(std::span<const int> candidates, double sigmas);
  float score(const DisparityPlane& plane) const;
  std::optional<DisparityPlane> best_hypothesis(std::span<const int> candidates,
                                                std::span<const std::int16_t> taken,
                                                const NormalPrior& prior, int hypotheses,
                                                Sampler& sampler) const;
  BlockPlane refitted(const DisparityPlane& start, std::span<const int> candidates) const;

  const BlockImage& blocks_;
  const DisparityGeometry& geometry_;
  const BlockNoise& noise_;
  std::vector<float> u_, v_, d_, n_, gate_;  ///< candidates side by side, for speed
};

}  // namespace lamina
