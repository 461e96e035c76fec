// The second and last touch of pixels in the plane stage.
#include <lamina/frontend/depth/pixel_labels.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include <lamina/frontend/depth/inner_blocks.hpp>
#include <lamina/frontend/depth/pixel_columns.hpp>
#include <lamina/frontend/depth/renamed_bytes.hpp>

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
  planes_.clear();
  least_.clear();
  passes_ = looks_ = 0;
  fill_inner(regions);
  moved_.assign(count, 1);
  steps_.assign(count, DisparityPlane::Zero());
  for (int pass = 0; pass < kPasses && count > 0; ++pass) {
    if (!label_border(regions, pass == 0 ? 4.5F : 3.5F, pass, pass > 0 ? 4 * sigma : 0)) break;
    ++passes_;
    refit(regions, 0.15 * static_cast<double>(sigma), pass == kAhead);
  }
}

void PixelLabeller::rename(std::span<const std::int16_t> renamed) {
  ByteTable table(renamed.size() + 1);
  for (std::size_t k = 0; k < renamed.size(); ++k) {
    table.to[k + 1] = static_cast<std::uint8_t>(renamed[k] + 1);
  }
  rename_bytes(*out_, table);
  for (std::int16_t& label : majority_) {
    label = static_cast<std::int16_t>(table.to[static_cast<std::size_t>(label + 1)] - 1);
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
  about_.set(labels, blocks_->columns, blocks_->rows);
  find_inner(labels, static_cast<std::size_t>(blocks_->columns), inner_, across_);
  for (int i = 0; i < static_cast<int>(blocks_->blocks.size()); ++i) {
    const Block& block = blocks_->blocks[static_cast<std::size_t>(i)];
    const std::int16_t label = inner_[static_cast<std::size_t>(i)];
    if (label < 0 || (block.n < whole && !is_untouched(i))) {
      if (block.n > 0) border_.push_back(border_of(i));
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
  Window w{u0, v0, std::min(image_->width - u0, size), std::min(image_->height - v0, size), offset};
  w.mid_u = static_cast<float>(w.u0 + 0.5 * (w.width - 1) - geometry_->cx);
  w.mid_v = static_cast<float>(w.v0 + 0.5 * (w.height - 1) - geometry_->cy);
  return w;
}

// The labels of the blocks about, two blocks' reach.
PixelLabeller::Border PixelLabeller::border_of(int block) const {
  Border border;
  border.block = block;
  border.window = window(block);
  border.near = about_.about(block % blocks_->columns, block / blocks_->columns);
  return border;
}

// What a residual from each of the planes costs: twice the negative logarithm of its likelihood, so
// that a steep plane's wider noise does not win.
PixelLabeller::Candidates PixelLabeller::candidates_of(const Border& border,
                                                       unsigned wanted) const {
  Candidates found;
  for (; wanted != 0; wanted &= wanted - 1) {
    const std::size_t k = static_cast<std::size_t>(std::countr_zero(wanted));
    const std::size_t i = static_cast<std::size_t>(found.count++);
    found.label[i] = border.near.label[k];
    found.bit[i] = static_cast<std::uint8_t>(k);
    found.plane[i] = costs_[static_cast<std::size_t>(border.near.label[k])];
  }
  return found;
}

// Which planes about a block can have pixels of it, if it was looked at before: what came no nearer
// to a plane then than this plane has moved since and more than noise allows does not fit it now,
// and goes to it in a crease alone. Bit k: label[k].
unsigned PixelLabeller::planes_within_reach(const Border& border, float band) const {
  constexpr float kSlack = 0.01F;  // px: rounding is less
  const std::size_t count = border.near.count;
  const unsigned all = (1U << count) - 1;
  if (border.least < 0 || !prune_) return all;
  const Least& least = least_[static_cast<std::size_t>(border.least)];
  const Eigen::Vector3f* const before =
      planes_.data() + static_cast<std::size_t>(least.pass) * costs_.size();
  const auto plane = [&](std::size_t k) -> const Cost& {
    return costs_[static_cast<std::size_t>(border.near.label[k])];
  };
  unsigned near = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Spread step = spread_of(
        border.window, plane(k).plane() - before[static_cast<std::size_t>(border.near.label[k])]);
    const bool reached = least.px[k] <= plane(k).gate + std::abs(step.middle) + step.reach + kSlack;
    near |= static_cast<unsigned>(reached) << k;
  }
  for (std::size_t k = 0; k < count && near != all; ++k) {
    for (std::size_t j = 0; j < k; ++j) {
      const Spread gap = spread_of(border.window, plane(k).plane() - plane(j).plane());
      const auto meet = static_cast<unsigned>(std::abs(gap.middle) <= gap.reach + band);
      near |= meet << k | meet << j;
    }
  }
  return near;
}

// What residuals from the regions' planes of this pass cost.
void PixelLabeller::take_planes(const PlaneRegions& regions, float sigmas) {
  costs_.clear();
  for (const PlaneRegion& region : regions.regions()) {
    const Eigen::Vector3f p = region.plane.cast<float>();
    const float ratio = 1 + jitter_variance(p.x(), p.y()) / variance_;
    costs_.push_back({p.x(), p.y(), p.z(), 1 / (variance_ * ratio), std::log(ratio),
                      sigmas * std::sqrt(variance_ * ratio)});
    planes_.push_back(p);
  }
}

// Every pixel of the border to the plane about it that fits best. False when nothing was to do.
bool PixelLabeller::label_border(const PlaneRegions& regions, float sigmas, int pass, float band) {
  const bool again = pass > 0;
  bool any = false;
  take_planes(regions, sigmas);
  for (Border& border : border_) {
    if (!again && &border + 3 < border_.data() + border_.size()) {
      const Window& next = (&border + 3)->window;
      for (int v = 0; v < next.height; ++v) __builtin_prefetch(image_->row(next.v0 + v) + next.u0);
    }
    unsigned touched = 0;
    for (std::size_t k = 0; k < border.near.count; ++k) {
      touched |= moved_[static_cast<std::size_t>(border.near.label[k])];
    }
    if (touched == 0) continue;
    any = true;  // and its block has a candidate
    const Window& w = border.window;
    const unsigned wanted =
        again ? planes_within_reach(border, band) | border.present : (1U << border.near.count) - 1;
    if (wanted == 0) continue;  // none has a pixel, none will
    const Candidates near = candidates_of(border, wanted);
    looks_ += near.count;
    if (again) keep_marks(w);
    // Blocks that were looked at twice will be again.
    const bool measure = again && border.least < 0 && border.near.count > 1;
    if (measure) {
      border.least = static_cast<int>(least_.size());
      least_.push_back({{}, pass});
    }
    label_pixels(border, near, sigmas, measure);
    if (band > 0) settle_creases(regions, border, near, band);
    if (again) {
      account_changes(border, near);
    } else {
      account(border, {out_->data() + w.offset, image_->width}, near, 1);
    }
  }
  return any;
}

void PixelLabeller::label_pixels(Border& border, const Candidates& near, float sigmas,
                                 bool measure) {
  const Window& w = border.window;
  std::array<Float4, Candidates::kMost> least;
  if (measure) least.fill(all(1e30F));
  for (int u = 0; u < w.width; u += kRow) {
    const PixelRows rows{image_->row(w.v0) + w.u0 + u,
                         out_->data() + w.offset + u,
                         image_->width,
                         std::min(kRow, w.width - u),
                         w.height,
                         static_cast<float>(w.u0 + u - geometry_->cx),
                         w.v0,
                         geometry_->cy};
    if (measure) {
      label_rows<true>(rows, near, sigmas * sigmas, least.data());
    } else {
      label_rows<false>(rows, near, sigmas * sigmas, nullptr);
    }
  }
  if (!measure) return;
  for (std::size_t k = 0; k < border.near.count; ++k) {
    const Float4& m = least[k];
    const float misfit = std::min(std::min(m[0], m[1]), std::min(m[2], m[3]));
    least_[static_cast<std::size_t>(border.least)].px[k] = std::sqrt(misfit / near.plane[k].weight);
  }
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
  const auto touches = [&](std::size_t k) { return border.near.touching >> near.bit[k] & 1; };
  for (std::size_t k = 0; k < static_cast<std::size_t>(near.count); ++k) {
    for (std::size_t j = 0; j < k; ++j) {
      if ((touches(k) & touches(j)) == 0) continue;  // no side without blocks of both
      const Eigen::Vector3f difference = near.plane[k].plane() - near.plane[j].plane();
      const Spread gap = spread_of(w, difference);
      if (std::abs(gap.middle) > gap.reach + band) continue;
      const float side =
          side_of(regions, border.block, near.label[k], near.label[j], difference, band);
      if (side == 0) continue;
      const Crease crease{difference.x(), band, side, static_cast<std::uint8_t>(near.label[k] + 1),
                          static_cast<std::uint8_t>(near.label[j] + 1)};
      for (int u = 0; u < w.width; u += kRow) {
        const PixelRows rows{image_->row(w.v0) + w.u0 + u,
                             out_->data() + w.offset + u,
                             image_->width,
                             std::min(kRow, w.width - u),
                             w.height,
                             static_cast<float>(w.u0 + u - geometry_->cx),
                             w.v0,
                             geometry_->cy};
        crease.settle_rows(rows, difference.y(), difference.z());
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
  // Blocks of the first, of the second, where it is negative, where it is positive.
  constexpr unsigned kSame = 1U << 1 | 1U << 2, kTurned = 1U << 0 | 1U << 3;
  unsigned seen = 0;
  // Without a branch; beyond the image's border its last blocks are seen twice.
  for (const int dr : {-1, 0, 1}) {
    const int row = std::clamp(r0 + dr, 0, blocks_->rows - 1);
    for (const int dc : {-1, 0, 1}) {
      const int column = std::clamp(c0 + dc, 0, blocks_->columns - 1);
      const std::size_t i = static_cast<std::size_t>(blocks_->index(column, row));
      const Block& b = blocks_->blocks[i];
      const float d = difference.dot(Eigen::Vector3f(b.u, b.v, 1));
      const bool theirs = (labels[i] == first) | (labels[i] == second);
      seen |= static_cast<unsigned>(theirs & (std::abs(d) > 0.5F * band))
              << (2 * (labels[i] == second) + (d > 0));
    }
  }
  return seen == kSame ? 1.0F : seen == kTurned ? -1.0F : 0.0F;
}

}  // namespace lamina
