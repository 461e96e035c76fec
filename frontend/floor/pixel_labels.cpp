// The second and last touch of pixels in the plane stage.
#include <lamina/frontend/floor/pixel_labels.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace lamina {
namespace {

constexpr int kPasses = 4;
using Candidates = PixelLabeller::Candidates;

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
                 float limit, std::uint8_t* out) {
  float value[kRow] = {}, best[kRow];
  std::int32_t label[kRow] = {};
  for (int i = 0; i < count; ++i) value[i] = d[i];
  for (int i = 0; i < kRow; ++i) best[i] = 1e9F;
  for (int k = 0; k < planes.count; ++k) {
    const std::size_t kk = static_cast<std::size_t>(k);
    const float a = planes.a[kk], base = planes.b[kk] * v + planes.c[kk] + a * u0;
    const float weight = planes.weight[kk], offset = planes.offset[kk];
    const std::int32_t mark = planes.label[kk] + 1;
    for (int i = 0; i < kRow; ++i) {
      const float r = value[i] - (base + a * static_cast<float>(i));
      const float misfit = weight * r * r;
      const float cost = misfit <= limit ? misfit + offset : 1e9F;
      label[i] = cost < best[i] ? mark : label[i];
      best[i] = cost < best[i] ? cost : best[i];
    }
  }
  for (int i = 0; i < count; ++i) {
    out[i] = value[i] > 0 ? static_cast<std::uint8_t>(label[i]) : std::uint8_t{0};
  }
}

void label_row(const float* d, int count, float u0, float v, const Candidates& planes, float limit,
               std::uint8_t* out) {
  for (int i = 0; i < count; i += kRow) {
    label_eight(d + i, std::min(kRow, count - i), u0 + static_cast<float>(i), v, planes, limit,
                out + i);
  }
}

// Sums over the pixels of one block that carry `mark`, lane by lane; from the middle of the block.
struct LaneSums {
  float n[kRow] = {}, y[kRow] = {}, yy[kRow] = {}, e[kRow] = {}, ye[kRow] = {}, ee[kRow] = {};

  void add_row(const float* d, const std::uint8_t* marks, std::uint8_t mark, float row,
               float shift) {
    for (int i = 0; i < kRow; ++i) {
      const float m = marks[i] == mark ? 1.0F : 0.0F;
      const float x = m * (d[i] - shift), z = m * row;
      n[i] += m;
      y[i] += z;
      yy[i] += z * row;
      e[i] += x;
      ye[i] += x * row;
      ee[i] += x * (d[i] - shift);
    }
  }

  // (u, v, d): the place that was subtracted.
  DisparitySums total(double u, double v, double d) const {
    double s[10] = {};  // n x y e xx xy yy xe ye ee
    for (int i = 0; i < kRow; ++i) {
      const double x = i - 0.5 * (kRow - 1);
      const double lane[6] = {n[i], y[i], yy[i], e[i], ye[i], ee[i]};
      s[0] += lane[0];
      s[1] += x * lane[0];
      s[2] += lane[1];
      s[3] += lane[3];
      s[4] += x * x * lane[0];
      s[5] += x * lane[1];
      s[6] += lane[2];
      s[7] += x * lane[3];
      s[8] += lane[4];
      s[9] += lane[5];
    }
    const DisparitySums sums{s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9]};
    return sums.shifted(u, v, d);
  }
};

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
  for (int pass = 0; pass < kPasses && count > 0; ++pass) {
    if (!label_border(regions, pass == 0 ? 4.5F : 3.5F, pass > 0, pass > 0 ? 4 * sigma : 0)) break;
    refit(regions, 0.15 * static_cast<double>(sigma));
  }
}

// Blocks with a whole ring of their own kind are filled; the others make the border.
void PixelLabeller::fill_inner(const PlaneRegions& regions) {
  const auto labels = regions.labels();
  const int columns = blocks_->columns, rows = blocks_->rows;
  const float whole = static_cast<float>(blocks_->size * blocks_->size);
  const auto is_inner = [&](int c, int r, std::int16_t label) {
    for (int rr = std::max(0, r - 1); rr <= std::min(rows - 1, r + 1); ++rr) {
      for (int cc = std::max(0, c - 1); cc <= std::min(columns - 1, c + 1); ++cc) {
        if (labels[static_cast<std::size_t>(blocks_->index(cc, rr))] != label) return false;
      }
    }
    return true;
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int i = blocks_->index(c, r);
      const Block& block = blocks_->blocks[static_cast<std::size_t>(i)];
      const std::int16_t label = labels[static_cast<std::size_t>(i)];
      if (block.n <= 0) continue;
      if (label < 0 || block.n < whole || !is_inner(c, r, label)) {
        border_.push_back(i);
        continue;
      }
      const Window w = window(i);
      fill_block(out_->data() + w.offset, image_->width, w.width, w.height,
                 static_cast<std::uint8_t>(label + 1));
      sums_[static_cast<std::size_t>(label)] += block.sums();
    }
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

// The planes of the blocks about, two blocks' reach, and what a residual from each costs: it is
// twice the negative logarithm of its likelihood, so that a steep plane's wider noise does not win.
PixelLabeller::Candidates PixelLabeller::candidates_around(const PlaneRegions& regions,
                                                           int block) const {
  const auto labels = regions.labels();
  const int c0 = block % blocks_->columns, r0 = block / blocks_->columns;
  Candidates found;
  for (int r = std::max(0, r0 - 2); r <= std::min(blocks_->rows - 1, r0 + 2); ++r) {
    for (int c = std::max(0, c0 - 2); c <= std::min(blocks_->columns - 1, c0 + 2); ++c) {
      const std::int16_t label = labels[static_cast<std::size_t>(blocks_->index(c, r))];
      if (label < 0 || found.count == Candidates::kMost) continue;
      const auto end = found.label.begin() + found.count;
      if (std::find(found.label.begin(), end, label) != end) continue;
      const std::size_t k = static_cast<std::size_t>(found.count++);
      const DisparityPlane& p = regions.regions()[static_cast<std::size_t>(label)].plane;
      found.label[k] = label;
      found.a[k] = static_cast<float>(p.x());
      found.b[k] = static_cast<float>(p.y());
      found.c[k] = static_cast<float>(p.z());
      const float ratio = 1 + jitter_variance(found.a[k], found.b[k]) / variance_;
      found.weight[k] = 1 / (variance_ * ratio);
      found.offset[k] = std::log(ratio);
    }
  }
  return found;
}

// Every pixel of the border to the plane about it that fits best. False when nothing was to do.
bool PixelLabeller::label_border(const PlaneRegions& regions, float sigmas, bool again,
                                 float band) {
  bool any = false;
  for (const int i : border_) {
    const Candidates near = candidates_around(regions, i);
    bool touched = false;
    for (int k = 0; k < near.count; ++k) {
      touched |= moved_[static_cast<std::size_t>(near.label[static_cast<std::size_t>(k)])] != 0;
    }
    if (!touched) continue;
    any = true;
    const Window w = window(i);
    if (again) account(w, near, -1);
    std::uint8_t* out = out_->data() + w.offset;
    for (int v = w.v0; v < w.v0 + w.height; ++v, out += image_->width) {
      label_row(image_->row(v) + w.u0, w.width, static_cast<float>(w.u0 - geometry_->cx),
                static_cast<float>(v - geometry_->cy), near, sigmas * sigmas, out);
    }
    if (band > 0) settle_creases(regions, i, near, band);
    account(w, near, 1);
  }
  return any;
}

// Where two planes meet, noise cannot tell their pixels apart for some rows about the line, but the
// line can: on one side of it all blocks about are the one's, on the other the other's.
void PixelLabeller::settle_creases(const PlaneRegions& regions, int block, const Candidates& near,
                                   float band) {
  const Window w = window(block);
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
      const float side = side_of(regions, block, near.label[k], near.label[j], difference, band);
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

// Adds a block's pixels to (or takes them from) the sums of the regions they are labelled with.
void PixelLabeller::account(const Window& w, const Candidates& near, int sign) {
  const float* d = image_->row(w.v0) + w.u0;
  const std::uint8_t* marks = out_->data() + w.offset;
  const double mid_v = w.v0 + 0.5 * (w.height - 1) - geometry_->cy;
  for (int k = 0; k < near.count; ++k) {
    const std::size_t label = static_cast<std::size_t>(near.label[static_cast<std::size_t>(k)]);
    const std::uint8_t mark = static_cast<std::uint8_t>(label + 1);
    for (int u = 0; u < w.width; u += kRow) {
      LaneSums lanes;
      const std::size_t ku = static_cast<std::size_t>(k);
      const double mid_u = w.u0 + u + 0.5 * (kRow - 1) - geometry_->cx;
      const float shift = static_cast<float>(near.a[ku] * mid_u + near.b[ku] * mid_v + near.c[ku]);
      for (int v = 0; v < w.height; ++v) {
        const float y = static_cast<float>(v) - 0.5F * static_cast<float>(w.height - 1);
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(v) * image_->width + u;
        if (w.width - u >= kRow) {
          lanes.add_row(d + at, marks + at, mark, y, shift);
          continue;
        }
        float row[kRow] = {};
        std::uint8_t row_marks[kRow] = {};
        std::copy(d + at, d + at + (w.width - u), row);
        std::copy(marks + at, marks + at + (w.width - u), row_marks);
        lanes.add_row(row, row_marks, mark, y, shift);
      }
      const DisparitySums sums = lanes.total(mid_u, mid_v, static_cast<double>(shift));
      if (sign > 0)
        sums_[label] += sums;
      else
        sums_[label] -= sums;
    }
  }
}

// Planes from their own pixels alone; marks those that moved by more than `least` px.
void PixelLabeller::refit(PlaneRegions& regions, double least) {
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    PlaneRegion& region = regions.regions()[k];
    region.sums = sums_[k];
    region.pixels = static_cast<std::int64_t>(std::llround(sums_[k].n));
    moved_[k] = 0;
    const auto fit = sums_[k].fit();
    if (!fit) continue;
    moved_[k] = sums_[k].mean_square(*fit - region.plane) > least * least;
    region.plane = *fit;
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
