// Hypotheses from blocks, scored on blocks.
#include <lamina/frontend/depth/recursive_ransac.hpp>

#include <cmath>

namespace lamina {

std::uint64_t Sampler::next() {
  state_ += 0x9E3779B97F4A7C15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

std::optional<DisparityPlane> BlockRansac::hypothesis(int index,
                                                      std::span<const std::int16_t> taken) const {
  const Block& center = blocks_.blocks[static_cast<std::size_t>(index)];
  const Eigen::Vector3f own(center.a, center.b,
                            center.d - center.a * center.u - center.b * center.v);
  const int c0 = index % blocks_.columns, r0 = index / blocks_.columns;
  // A block's own slope is good to a few sigmas of its mean over one block's width.
  const double limit = 25 * noise_.of_mean(center.n) + 4 * noise_.pixel;
  DisparitySums sums;
  for (int r = std::max(0, r0 - 1); r <= std::min(blocks_.rows - 1, r0 + 1); ++r) {
    for (int c = std::max(0, c0 - 1); c <= std::min(blocks_.columns - 1, c0 + 1); ++c) {
      const std::size_t i = static_cast<std::size_t>(blocks_.index(c, r));
      const Block& block = blocks_.blocks[i];
      if (!block.flat || taken[i] >= 0) continue;
      const double residual = block.residual(own);
      if (residual * residual <= limit) sums += block.sums();
    }
  }
  return sums.fit();
}

void BlockRansac::gather(std::span<const int> candidates, double sigmas) {
  const std::size_t size = candidates.size();
  for (auto* column : {&u_, &v_, &d_, &n_, &gate_}) column->resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const Block& b = blocks_.blocks[static_cast<std::size_t>(candidates[i])];
    u_[i] = b.u;
    v_[i] = b.v;
    d_[i] = b.d;
    n_[i] = b.n;
    gate_[i] = static_cast<float>(sigmas * std::sqrt(noise_.of_mean(b.n)));
  }
}

float BlockRansac::score(const DisparityPlane& plane) const {
  const float a = static_cast<float>(plane.x()), b = static_cast<float>(plane.y()),
              c = static_cast<float>(plane.z());
  float pixels[4] = {0, 0, 0, 0};  // four sums: the order is fixed, and so is the rounding
  const std::size_t size = u_.size(), whole = size & ~std::size_t{3};
  for (std::size_t i = 0; i < whole; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) {
      const float r = d_[i + k] - (a * u_[i + k] + b * v_[i + k] + c);
      pixels[k] += std::abs(r) <= gate_[i + k] ? n_[i + k] : 0.0F;
    }
  }
  for (std::size_t i = whole; i < size; ++i) {
    const float r = d_[i] - (a * u_[i] + b * v_[i] + c);
    pixels[0] += std::abs(r) <= gate_[i] ? n_[i] : 0.0F;
  }
  return (pixels[0] + pixels[1]) + (pixels[2] + pixels[3]);
}

// The admitted one of most pixels.
std::optional<DisparityPlane> BlockRansac::best_hypothesis(std::span<const int> candidates,
                                                           std::span<const std::int16_t> taken,
                                                           const NormalPrior& prior, int hypotheses,
                                                           Sampler& sampler) const {
  std::optional<DisparityPlane> best;
  float best_score = 0;
  for (int k = 0; k < hypotheses; ++k) {
    const int pick = sampler.below(static_cast<int>(candidates.size()));
    const auto candidate = hypothesis(candidates[static_cast<std::size_t>(pick)], taken);
    if (!candidate) continue;
    const auto plane = geometry_.plane(*candidate);
    if (!plane || !prior.admits(*plane)) continue;
    const float s = score(*candidate);
    if (s > best_score) {
      best_score = s;
      best = candidate;
    }
  }
  return best;
}

// Twice: the first fit reaches as far as its sample, the second as far as the section. The last
// round only says who belongs.
BlockPlane BlockRansac::refitted(const DisparityPlane& start,
                                 std::span<const int> candidates) const {
  BlockPlane result{start, {}, 0};
  for (int round = 0; round < 3; ++round) {
    const Eigen::Vector3f p = result.plane.cast<float>();
    const float slack = round == 0 ? 1.5F : 1.0F;
    DisparitySums sums;
    result.inliers.clear();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const Block& b = blocks_.blocks[static_cast<std::size_t>(candidates[i])];
      if (std::abs(b.residual(p)) > slack * gate_[i]) continue;
      if (round < 2) {
        sums += b.sums();
      } else {
        sums.n += b.n;
      }
      result.inliers.push_back(candidates[i]);
    }
    result.pixels = sums.n;
    if (round == 2) break;
    const auto fit = sums.fit();
    if (!fit) break;
    result.plane = *fit;
  }
  return result;
}

std::optional<BlockPlane> BlockRansac::best_plane(std::span<const int> candidates,
                                                  std::span<const std::int16_t> taken,
                                                  const NormalPrior& prior, double sigmas,
                                                  int hypotheses, double min_pixels,
                                                  Sampler& sampler) {
  if (candidates.empty()) return std::nullopt;
  gather(candidates, sigmas);
  const auto best = best_hypothesis(candidates, taken, prior, hypotheses, sampler);
  if (!best) return std::nullopt;
  BlockPlane result = refitted(*best, candidates);
  const auto plane = geometry_.plane(result.plane);
  if (result.pixels < min_pixels || !plane || !prior.admits(*plane)) return std::nullopt;
  return result;
}

}  // namespace lamina
