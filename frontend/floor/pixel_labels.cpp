// The second and last touch of pixels in the plane stage.
#include <lamina/frontend/floor/pixel_labels.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace lamina {
namespace {

constexpr int kMaxCandidates = 6;

struct Candidates {
  std::array<std::int16_t, kMaxCandidates> label{};
  std::array<float, kMaxCandidates> a{}, b{}, c{};
  int count = 0;
};

Candidates candidates_around(const BlockImage& blocks, std::span<const std::int16_t> labels,
                             const PlaneRegions& regions, int c0, int r0) {
  Candidates found;
  for (int r = std::max(0, r0 - 2); r <= std::min(blocks.rows - 1, r0 + 2); ++r) {
    for (int c = std::max(0, c0 - 2); c <= std::min(blocks.columns - 1, c0 + 2); ++c) {
      const std::int16_t label = labels[static_cast<std::size_t>(blocks.index(c, r))];
      if (label < 0 || found.count == kMaxCandidates) continue;
      const auto end = found.label.begin() + found.count;
      if (std::find(found.label.begin(), end, label) != end) continue;
      const std::size_t k = static_cast<std::size_t>(found.count++);
      const DisparityPlane& p = regions.regions()[static_cast<std::size_t>(label)].plane;
      found.label[k] = label;
      found.a[k] = static_cast<float>(p.x());
      found.b[k] = static_cast<float>(p.y());
      found.c[k] = static_cast<float>(p.z());
    }
  }
  return found;
}

void fill_block(std::uint8_t* out, int stride, int width, int height, std::uint8_t mark) {
  std::uint8_t eight[8];
  std::memset(eight, mark, 8);
  for (int v = 0; v < height; ++v, out += stride) {
    if (width == 8) {
      std::memcpy(out, eight, 8);  // one store: blocks are eight wide unless set otherwise
    } else {
      std::memset(out, mark, static_cast<std::size_t>(width));
    }
  }
}

constexpr int kRow = 8;

// Best plane for each of up to eight pixels side by side; `v` from the principal point. Lanes are
// of one width and their number is fixed, so that compilers make vectors of them.
void label_eight(const float* d, int count, float u0, float v, const Candidates& planes,
                 float tolerance, std::uint8_t* out) {
  float value[kRow] = {}, best[kRow];
  std::int32_t label[kRow] = {};
  for (int i = 0; i < count; ++i) value[i] = d[i];
  for (int i = 0; i < kRow; ++i) best[i] = tolerance;
  for (int k = 0; k < planes.count; ++k) {
    const std::size_t kk = static_cast<std::size_t>(k);
    const float a = planes.a[kk], base = planes.b[kk] * v + planes.c[kk] + a * u0;
    const std::int32_t mark = planes.label[kk] + 1;
    for (int i = 0; i < kRow; ++i) {
      const float r = std::abs(value[i] - (base + a * static_cast<float>(i)));
      label[i] = r < best[i] ? mark : label[i];
      best[i] = r < best[i] ? r : best[i];
    }
  }
  for (int i = 0; i < count; ++i) {
    out[i] = value[i] > 0 ? static_cast<std::uint8_t>(label[i]) : std::uint8_t{0};
  }
}

void label_row(const float* d, int count, float u0, float v, const Candidates& planes,
               float tolerance, std::uint8_t* out) {
  for (int i = 0; i < count; i += kRow) {
    label_eight(d + i, std::min(kRow, count - i), u0 + static_cast<float>(i), v, planes, tolerance,
                out + i);
  }
}

}  // namespace

void label_pixels(const DisparityImage& image, const DisparityGeometry& g, const BlockImage& blocks,
                  float tolerance, PlaneRegions& regions, std::vector<std::uint8_t>& pixel_labels) {
  pixel_labels.assign(image.d.size(), 0);
  const auto labels = regions.labels();
  std::vector<std::int64_t> counts(regions.regions().size() + 1, 0);
  const int size = blocks.size;
  const float whole = static_cast<float>(size * size);
  for (int r = 0; r < blocks.rows; ++r) {
    const int v0 = r * size, v1 = std::min(image.height, v0 + size);
    for (int c = 0; c < blocks.columns; ++c) {
      const std::size_t i = static_cast<std::size_t>(blocks.index(c, r));
      const Block& block = blocks.blocks[i];
      if (block.n <= 0) continue;
      const int u0 = c * size, width = std::min(image.width - u0, size);
      std::uint8_t* out = pixel_labels.data() +
                          static_cast<std::size_t>(v0) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(u0);
      if (labels[i] >= 0 && block.n >= whole) {
        fill_block(out, image.width, width, v1 - v0, static_cast<std::uint8_t>(labels[i] + 1));
        counts[static_cast<std::size_t>(labels[i] + 1)] += size * size;
        continue;
      }
      const Candidates near = candidates_around(blocks, labels, regions, c, r);
      if (near.count == 0) continue;
      for (int v = v0; v < v1; ++v, out += image.width) {
        label_row(image.row(v) + u0, width, static_cast<float>(u0 - g.cx),
                  static_cast<float>(v - g.cy), near, tolerance, out);
        for (int k = 0; k < width; ++k) ++counts[out[k]];
      }
    }
  }
  for (std::size_t k = 0; k < regions.regions().size(); ++k) {
    regions.regions()[k].pixels = counts[k + 1];
  }
}

std::vector<std::int16_t> block_majority(const std::vector<std::uint8_t>& pixel_labels, int width,
                                         int height, const BlockImage& blocks,
                                         std::span<const std::int16_t> block_labels) {
  std::vector<std::int16_t> result(block_labels.begin(), block_labels.end());
  for (int r = 0; r < blocks.rows; ++r) {
    for (int c = 0; c < blocks.columns; ++c) {
      const std::size_t i = static_cast<std::size_t>(blocks.index(c, r));
      if (result[i] >= 0 || blocks.blocks[i].n <= 0) continue;
      std::array<int, 256> votes{};
      const int v1 = std::min(height, (r + 1) * blocks.size);
      const int u1 = std::min(width, (c + 1) * blocks.size);
      for (int v = r * blocks.size; v < v1; ++v) {
        const std::uint8_t* row =
            pixel_labels.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
        for (int u = c * blocks.size; u < u1; ++u) ++votes[row[u]];
      }
      const auto most = std::max_element(votes.begin() + 1, votes.end());
      if (2 * *most >= blocks.size * blocks.size) {
        result[i] = static_cast<std::int16_t>(most - votes.begin() - 1);
      }
    }
  }
  return result;
}

}  // namespace lamina
