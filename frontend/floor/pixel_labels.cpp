// The second and last touch of pixels in the plane stage.
#include <lamina/frontend/floor/pixel_labels.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <lamina/frontend/floor/inner_blocks.hpp>
#include <lamina/frontend/floor/pixel_columns.hpp>

namespace lamina {

using namespace lanes;

namespace {

using Candidates = PixelLabeller::Candidates;
constexpr int kRow = PixelColumns::kRow;
constexpr int kPasses = 5, kAhead = 2;  // at kAhead planes go where their steps lead

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

}  // namespace

void PixelLabeller::label(const DisparityImage& image, const DisparityGeometry& g,
                          const BlockImage& blocks, float sigma, PlaneRegions& regions,
                          std::vector<std::uint8_t>& pixel_labels) {
  image_ = &image;
  geometry_ = &g;
  blocks_ = &blocks;
  out_ = &pixel_labels;
  variance_ = sigma * sigma;
  pixel_labels.assign(image.d.size(), 0);
  const std::size_t count = regions.regions().size();
  sums_.assign(count, DisparitySums());
  border_.clear();
  fill_inner(regions);
  moved_.assign(count, 1);
  steps_.assign(count, DisparityPlane::Zero());
  for (int pass = 0; pass < kPasses && count > 0; ++pass) {
    if (!label_border(regions, pass == 0 ? 4.5F : 3.5F, pass > 0, pass > 0 ? 4 * sigma : 0)) break;
    refit(regions, 0.15 * static_cast<double>(sigma), pass == kAhead);
  }
}

void PixelLabeller::rename(std::span<const std::int16_t> renamed) {
  std::array<std::uint8_t, 256> marks{};
  for (std::size_t k = 0; k < renamed.size(); ++k) {
    marks[k + 1] = static_cast<std::uint8_t>(renamed[k] + 1);
  }
  std::vector<std::uint8_t>& is_border = scratch_;
  is_border.assign(majority_.size(), 0);
  for (const Border& border : border_) {
    is_border[static_cast<std::size_t>(border.block)] = 1;
    const auto last = border.label.begin() + border.count;
    if (std::all_of(border.label.begin(), last, [renamed](std::int16_t label) {
          return renamed[static_cast<std::size_t>(label)] == label;
        })) {
      continue;
    }
    const Window& w = border.window;
    std::uint8_t* out = out_->data() + w.offset;
    for (int v = 0; v < w.height; ++v, out += image_->width) {
      for (int u = 0; u < w.width; ++u) out[u] = marks[out[u]];
    }
  }
  for (std::size_t i = 0; i < majority_.size(); ++i) {
    const std::int16_t label = majority_[i];
    if (label < 0) continue;
    majority_[i] = renamed[static_cast<std::size_t>(label)];
    if (is_border[i] != 0 || majority_[i] == label) continue;
    fill(static_cast<int>(i), static_cast<std::uint8_t>(majority_[i] + 1));
  }
}

// The block's measured pixels.
void PixelLabeller::fill(int block, std::uint8_t mark) {
  const Window w = window(block);
  std::uint8_t* out = out_->data() + w.offset;
  const int size = blocks_->size;
  if (blocks_->blocks[static_cast<std::size_t>(block)].n >= static_cast<float>(size * size)) {
    fill_block(out, image_->width, w.width, w.height, mark);
    return;
  }
  for (int v = 0; v < w.height; ++v, out += image_->width) {
    const float* const d = image_->row(w.v0 + v) + w.u0;
    for (int u = 0; u < w.width; ++u) out[u] = d[u] > 0 ? mark : std::uint8_t{0};
  }
}

// No pixel of the block was taken out as an outlier: its sums hold all that were measured.
bool PixelLabeller::is_untouched(int block) const {
  const Window w = window(block);
  int measured = 0;
  for (int v = 0; v < w.height; ++v) {
    const float* const d = image_->row(w.v0 + v) + w.u0;
    for (int u = 0; u < w.width; ++u) measured += d[u] > 0;
  }
  return blocks_->blocks[static_cast<std::size_t>(block)].n == static_cast<float>(measured);
}

// Blocks with a whole ring of their own kind are filled, those that lack pixels as well: tested one
// by one, the pixels of a wall whose noise is underrated would become obstacles before it. The
// others make the border, and so do blocks with outliers.
void PixelLabeller::fill_inner(const PlaneRegions& regions) {
  const auto labels = regions.labels();
  const float whole = static_cast<float>(blocks_->size * blocks_->size);
  majority_.assign(labels.begin(), labels.end());
  find_inner(labels, static_cast<std::size_t>(blocks_->columns), inner_, across_);
  for (int i = 0; i < static_cast<int>(blocks_->blocks.size()); ++i) {
    const Block& block = blocks_->blocks[static_cast<std::size_t>(i)];
    const std::int16_t label = inner_[static_cast<std::size_t>(i)];
    if (label < 0 || (block.n < whole && !is_untouched(i))) {
      if (block.n > 0) border_.push_back(neighbours_of(regions, i));
      continue;
    }
    fill(i, static_cast<std::uint8_t>(label + 1));
    sums_[static_cast<std::size_t>(label)] += block.sums();
  }
}

PixelLabeller::Window PixelLabeller::window(int block) const {
  const int size = blocks_->size;
  const int u0 = block % blocks_->columns * size, v0 = block / blocks_->columns * size;
  const std::size_t offset =
      static_cast<std::size_t>(v0) * static_cast<std::size_t>(image_->width) +
      static_cast<std::size_t>(u0);
  return {u0, v0, std::min(image_->width - u0, size), std::min(image_->height - v0, size), offset};
}

// The labels of the blocks about, two blocks' reach.
PixelLabeller::Border PixelLabeller::neighbours_of(const PlaneRegions& regions, int block) const {
  const auto labels = regions.labels();
  const int c0 = block % blocks_->columns, r0 = block / blocks_->columns;
  Border found;
  found.block = block;
  found.window = window(block);
  std::int16_t last = -1;
  const int first_column = std::max(0, c0 - 2),
            last_column = std::min(blocks_->columns - 1, c0 + 2);
  for (int r = std::max(0, r0 - 2); r <= std::min(blocks_->rows - 1, r0 + 2); ++r) {
    const std::int16_t* const row = labels.data() + blocks_->index(0, r);
    for (int c = first_column; c <= last_column; ++c) {
      const std::int16_t label = row[c];
      if (label == last || label < 0 || found.count == Candidates::kMost) continue;
      last = label;
      const auto end = found.label.begin() + found.count;
      if (std::find(found.label.begin(), end, label) == end) {
        found.label[static_cast<std::size_t>(found.count++)] = label;
      }
    }
  }
  return found;
}

// What a residual from each of the planes costs: twice the negative logarithm of its likelihood, so
// that a steep plane's wider noise does not win.
PixelLabeller::Candidates PixelLabeller::candidates_of(const Border& border) const {
  Candidates found;
  found.count = border.count;
  found.label = border.label;
  for (std::size_t k = 0; k < static_cast<std::size_t>(border.count); ++k) {
    const Cost& cost = costs_[static_cast<std::size_t>(border.label[k])];
    found.a[k] = cost.plane.x();
    found.b[k] = cost.plane.y();
    found.c[k] = cost.plane.z();
    found.weight[k] = cost.weight;
    found.offset[k] = cost.offset;
  }
  return found;
}

// Every pixel of the border to the plane about it that fits best. False when nothing was to do.
bool PixelLabeller::label_border(const PlaneRegions& regions, float sigmas, bool again,
                                 float band) {
  bool any = false;
  costs_.clear();
  for (const PlaneRegion& region : regions.regions()) {
    const Eigen::Vector3f p = region.plane.cast<float>();
    const float ratio = 1 + jitter_variance(p.x(), p.y()) / variance_;
    costs_.push_back({p, 1 / (variance_ * ratio), std::log(ratio)});
  }
  for (const Border& border : border_) {
    const auto last = border.label.begin() + border.count;
    const bool touched = std::any_of(border.label.begin(), last, [this](std::int16_t label) {
      return moved_[static_cast<std::size_t>(label)] != 0;
    });
    if (!touched) continue;
    any = true;  // and its block has a candidate
    const Candidates near = candidates_of(border);
    const Window& w = border.window;
    std::uint8_t* const out = out_->data() + w.offset;
    if (again) keep_marks(w);
    for (int u = 0; u < w.width; u += kRow) {
      const PixelColumns columns(near, static_cast<float>(w.u0 + u - geometry_->cx));
      std::uint8_t* to = out + u;
      for (int v = w.v0; v < w.v0 + w.height; ++v, to += image_->width) {
        label_eight(image_->row(v) + w.u0 + u, std::min(kRow, w.width - u), columns,
                    static_cast<float>(v - geometry_->cy), sigmas * sigmas, to);
      }
    }
    if (band > 0) settle_creases(regions, border, near, band);
    if (again) {
      account_changes(border.block, w, near);
    } else {
      account(border.block, w, {out_->data() + w.offset, image_->width}, near, 1);
    }
  }
  return any;
}

void PixelLabeller::keep_marks(const Window& w) {
  const std::uint8_t* row = out_->data() + w.offset;
  old_marks_.resize(static_cast<std::size_t>(w.width * w.height));
  std::uint8_t* to = old_marks_.data();
  for (int v = 0; v < w.height; ++v, row += image_->width, to += w.width) {
    if (w.width == kRow) {
      std::memcpy(to, row, kRow);  // of known length: one load and one store
    } else {
      std::memcpy(to, row, static_cast<std::size_t>(w.width));
    }
  }
}

// Where two planes meet, noise cannot tell their pixels apart for some rows about the line, but the
// line can: on one side of it all blocks about are the one's, on the other the other's.
void PixelLabeller::settle_creases(const PlaneRegions& regions, const Border& border,
                                   const Candidates& near, float band) {
  const Window& w = border.window;
  const float mid_u = static_cast<float>(w.u0 + 0.5 * (w.width - 1) - geometry_->cx);
  const float mid_v = static_cast<float>(w.v0 + 0.5 * (w.height - 1) - geometry_->cy);
  for (std::size_t k = 0; k < static_cast<std::size_t>(near.count); ++k) {
    for (std::size_t j = 0; j < k; ++j) {
      const Eigen::Vector3f difference(near.a[k] - near.a[j], near.b[k] - near.b[j],
                                       near.c[k] - near.c[j]);
      const float middle = difference.dot(Eigen::Vector3f(mid_u, mid_v, 1));
      const float reach = 0.5F * static_cast<float>(blocks_->size) *
                          (std::abs(difference.x()) + std::abs(difference.y()));
      if (std::abs(middle) > reach + band) continue;
      const float side =
          side_of(regions, border.block, near.label[k], near.label[j], difference, band);
      if (side == 0) continue;
      const std::uint8_t first = static_cast<std::uint8_t>(near.label[k] + 1);
      const std::uint8_t second = static_cast<std::uint8_t>(near.label[j] + 1);
      std::uint8_t* out = out_->data() + w.offset;
      for (int v = 0; v < w.height; ++v, out += image_->width) {
        float d = difference.dot(Eigen::Vector3f(static_cast<float>(w.u0 - geometry_->cx),
                                                 static_cast<float>(w.v0 + v - geometry_->cy), 1));
        for (int u = 0; u < w.width; ++u, d += difference.x()) {
          if ((out[u] != first && out[u] != second) || std::abs(d) > band) continue;
          out[u] = side * d > 0 ? first : second;
        }
      }
    }
  }
}

// 1 when blocks of `first` lie where `difference` is positive and those of `second` where it is
// negative, -1 when it is the other way round, 0 when they do not agree or one is not there.
float PixelLabeller::side_of(const PlaneRegions& regions, int block, int first, int second,
                             const Eigen::Vector3f& difference, float band) const {
  const auto labels = regions.labels();
  const int c0 = block % blocks_->columns, r0 = block / blocks_->columns;
  int votes[2][2] = {{0, 0}, {0, 0}};  // [whose][where positive]
  for (int r = std::max(0, r0 - 1); r <= std::min(blocks_->rows - 1, r0 + 1); ++r) {
    for (int c = std::max(0, c0 - 1); c <= std::min(blocks_->columns - 1, c0 + 1); ++c) {
      const std::size_t i = static_cast<std::size_t>(blocks_->index(c, r));
      if (labels[i] != first && labels[i] != second) continue;
      const Block& b = blocks_->blocks[i];
      const float d = difference.dot(Eigen::Vector3f(b.u, b.v, 1));
      if (std::abs(d) > 0.5F * band) ++votes[labels[i] == second][d > 0];
    }
  }
  if (votes[0][1] > 0 && votes[1][0] > 0 && votes[0][0] + votes[1][1] == 0) return 1;
  if (votes[0][0] > 0 && votes[1][1] > 0 && votes[0][1] + votes[1][0] == 0) return -1;
  return 0;
}

}  // namespace lamina
