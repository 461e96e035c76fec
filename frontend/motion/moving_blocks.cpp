// Free space that is no longer free, block by block.
#include <lamina/frontend/motion/moving_blocks.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr float kDepthShare = 0.1F, kSigmas = 4;
constexpr double kNoise = 0.005;  ///< share of places below which they are noise
constexpr int kReach = 2;         ///< blocks, as DepthBlockOptions::reach

/// True where all nine blocks around (u, v) are further than z.
bool before_all(const DepthBlocks& back, int u, int v, float z, float sigma) {
  if (u < 1 || v < 1 || u + 1 >= back.width || v + 1 >= back.height) return false;
  for (int j = v - 1; j <= v + 1; ++j) {
    for (int i = u - 1; i <= u + 1; ++i) {
      const DepthBlock& k = back.at(i, j);
      if (!k.valid() || k.point.z() - z < kDepthShare * z + kSigmas * (k.sigma + sigma)) {
        return false;
      }
    }
  }
  return true;
}

/// Marks the blocks whose normals were fitted over a marked one, too.
std::vector<std::uint8_t> widened(const DepthBlocks& blocks,
                                  const std::vector<std::uint8_t>& marks) {
  std::vector<std::uint8_t> result(marks.size(), 0);
  for (int v = 0, i = 0; v < blocks.height; ++v) {
    for (int u = 0; u < blocks.width; ++u, ++i) {
      if (!marks[static_cast<std::size_t>(i)]) continue;
      const int right = std::min(u + kReach, blocks.width - 1);
      const int low = std::min(v + kReach, blocks.height - 1);
      for (int y = std::max(v - kReach, 0); y <= low; ++y) {
        const auto row = result.begin() + y * blocks.width;
        std::fill(row + std::max(u - kReach, 0), row + right + 1, std::uint8_t{1});
      }
    }
  }
  return result;
}

}  // namespace

SeenFrom seen_from(const DepthBlocks& back, const Eigen::Vector3f& point, float sigma) {
  const DepthBlock* under = block_under(back, point);
  if (!under || !under->valid()) return SeenFrom::kUnknown;
  const int at = static_cast<int>(under - back.blocks.data());
  if (before_all(back, at % back.width, at / back.width, point.z(), sigma))
    return SeenFrom::kBefore;
  const float off = std::abs(under->point.z() - point.z());
  return off < kDepthShare * point.z() + kSigmas * (under->sigma + sigma) ? SeenFrom::kLike
                                                                          : SeenFrom::kUnknown;
}

std::vector<std::uint8_t> moving_blocks(const DepthBlocks& back, const DepthBlocks& front,
                                        const SE3& T_back_front) {
  const Eigen::Matrix3f R = T_back_front.so3().matrix().cast<float>();
  const Eigen::Vector3f t = T_back_front.translation().cast<float>();
  std::vector<std::uint8_t> marks(front.blocks.size(), 0);
  std::size_t met = 0, before = 0;
  for (std::size_t i = 0; i < front.blocks.size(); ++i) {
    const DepthBlock& c = front.blocks[i];
    if (!c.oriented()) continue;
    const Eigen::Vector3f q = R * c.point + t;
    const DepthBlock* under = block_under(back, q);
    if (!under) continue;
    ++met;
    const int at = static_cast<int>(under - back.blocks.data());
    if (!before_all(back, at % back.width, at / back.width, q.z(), c.sigma)) continue;
    marks[i] = 1;
    ++before;
  }
  if (static_cast<double>(before) <= kNoise * static_cast<double>(met)) return {};
  return widened(front, marks);
}

double drop_blocks(DepthBlocks& blocks, const std::vector<std::uint8_t>& marks) {
  if (marks.empty()) return 0;
  std::size_t oriented = 0, dropped = 0;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    oriented += blocks.blocks[i].oriented();
    if (!marks[i]) continue;
    dropped += blocks.blocks[i].oriented();
    blocks.blocks[i] = DepthBlock{};
  }
  return oriented > 0 ? static_cast<double>(dropped) / static_cast<double>(oriented) : 0;
}

}  // namespace lamina
