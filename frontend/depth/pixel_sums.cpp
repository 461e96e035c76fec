// Sums of the regions as pixels of their borders change hands.
#include <lamina/frontend/depth/pixel_labels.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include <lamina/frontend/depth/pixel_columns.hpp>

namespace lamina {

using namespace lanes;

namespace {

using Candidates = PixelLabeller::Candidates;
constexpr int kRow = PixelColumns::kRow;
constexpr double kSmallShare = 0.03;  // of the image: planes that their border may bend
constexpr int kFewChanges = 12;       // pixels of a block: as quick one by one as all anew

struct Change {
  int u, v;  // in the block
  std::uint8_t from, to;
};

// Pixels of a block that changed hands; where they are many, not which.
struct Changes {
  std::array<Change, kFewChanges> list;
  int count = 0;

  bool many() const { return count > kFewChanges; }
  void add(int u, int v, std::uint8_t from, std::uint8_t to) {
    if (++count <= kFewChanges) list[static_cast<std::size_t>(count - 1)] = {u, v, from, to};
  }
};

template <class Marks>
Changes changes_between(const Marks& old, const Marks& now, int width, int height) {
  Changes changes;
  if (width == kRow && height <= kRow) {
    // A bit a pixel, row by row.
    std::uint64_t differ = changed_bits8(old.first, now.first, now.stride, height);
    for (; differ != 0 && !changes.many(); differ &= differ - 1) {
      const int i = std::countr_zero(differ), u = i % kRow, v = i / kRow;
      changes.add(u, v, old.first[i], now.first[std::ptrdiff_t{v} * now.stride + u]);
    }
    return changes;
  }
  for (int v = 0; v < height && !changes.many(); ++v) {
    const std::uint8_t* a = old.first + static_cast<std::ptrdiff_t>(v) * old.stride;
    const std::uint8_t* b = now.first + static_cast<std::ptrdiff_t>(v) * now.stride;
    for (int u = 0; u < width; ++u) {
      if (a[u] != b[u]) changes.add(u, v, a[u], b[u]);
    }
  }
  return changes;
}

DisparitySums to_sums(const BlockSums& s, double u, double v, double d) {
  const auto wide = [](float x) { return static_cast<double>(x); };
  const DisparitySums sums{wide(s.count()),  wide(s.sum_x()),  wide(s.sum_y()),  wide(s.sum_e()),
                           wide(s.sum_xx()), wide(s.sum_xy()), wide(s.sum_yy()), wide(s.sum_xe()),
                           wide(s.sum_ye()), wide(s.sum_ee())};
  return sums.shifted(u, v, d);
}

// How many of its last steps a plane has yet to go, if each is the same share of the one before
// (Aitken). None unless the last two go the same way.
double way_left(const DisparitySums& sums, const DisparityPlane& before,
                const DisparityPlane& last) {
  constexpr double kMost = 3;
  const double square = sums.mean_square(before);
  const double product = (sums.mean_square(before + last) - sums.mean_square(before - last)) / 4;
  const double share = product / square;
  if (!(square > 0) || !(share > 0)) return 0;
  return share < kMost / (1 + kMost) ? share / (1 - share) : kMost;
}

}  // namespace

// Counts the pixels of each candidate.
PixelLabeller::Counts PixelLabeller::count(Border& border, const Marks& marks,
                                           const Candidates& near) {
  const Window& w = border.window;
  border.pixels = {};
  Counts counts{};
  int others = w.width * w.height;
  for (std::size_t k = 0; k < static_cast<std::size_t>(near.count) && others > 0; ++k) {
    const std::uint8_t mark = static_cast<std::uint8_t>(near.label[k] + 1);
    if (w.width == kRow) {
      counts[k] = count_eights(marks.first, marks.stride, w.height, mark);
    } else {
      for (int v = 0; v < w.height; ++v) {
        const std::uint8_t* row = marks.first + static_cast<std::ptrdiff_t>(v) * marks.stride;
        counts[k] += static_cast<int>(std::count(row, row + w.width, mark));
      }
    }
    others -= counts[k];
    border.pixels[near.bit[k]] = static_cast<std::uint16_t>(counts[k]);
  }
  note_holders(border);
  return counts;
}

// Which of its planes have pixels of a block, and which of them holds it.
void PixelLabeller::note_holders(Border& border) {
  std::int16_t majority = -1;
  unsigned present = 0;
  for (std::size_t k = 0; k < border.near.count; ++k) {
    const int pixels = border.pixels[k];
    present |= static_cast<unsigned>(pixels > 0) << k;
    if (2 * pixels >= blocks_->size * blocks_->size) majority = border.near.label[k];
  }
  border.present = static_cast<std::uint8_t>(present);
  majority_[static_cast<std::size_t>(border.block)] = majority;
}

// Adds a block's pixels to (or takes them from) the sums of the regions they are labelled with.
void PixelLabeller::account(Border& border, const Marks& marks, const Candidates& near, int sign) {
  const Window& w = border.window;
  Counts counts{};
  if (sign > 0) {
    counts = count(border, marks, near);
  } else {  // known from when they were added
    for (std::size_t k = 0; k < static_cast<std::size_t>(near.count); ++k) {
      counts[k] = border.pixels[near.bit[k]];
    }
  }
  const Block& whole = blocks_->blocks[static_cast<std::size_t>(border.block)];
  for (std::size_t k = 0; k < static_cast<std::size_t>(near.count); ++k) {
    if (counts[k] == 0) continue;
    const std::uint8_t mark = static_cast<std::uint8_t>(near.label[k] + 1);
    const bool all = counts[k] == w.width * w.height;
    const DisparitySums part = all && whole.n >= static_cast<float>(counts[k])
                                   ? whole.sums()
                                   : sums_of(w, marks, mark, near.plane[k].plane());
    DisparitySums& sums = sums_[static_cast<std::size_t>(near.label[k])];
    if (sign > 0) {
      sums += part;
    } else {
      sums -= part;
    }
  }
}

// A block whose labels were old_marks_: pixels that stay where they are change no sums, few move by
// themselves, many with all the others.
void PixelLabeller::account_changes(Border& border, const Candidates& near) {
  const Window& w = border.window;
  const Marks now{out_->data() + w.offset, image_->width}, old{old_marks_.data(), w.width};
  const Changes changes = changes_between(old, now, w.width, w.height);
  if (changes.count == 0) return;
  if (changes.many()) {
    account(border, old, near, -1);
    account(border, now, near, 1);
    return;
  }
  std::array<std::uint8_t, 256> place;  // of a mark among the border's labels; for these alone
  for (std::size_t k = 0; k < static_cast<std::size_t>(near.count); ++k) {
    place[static_cast<std::size_t>(near.label[k]) + 1] = near.bit[k];
  }
  for (int i = 0; i < changes.count; ++i) {
    const Change& c = changes.list[static_cast<std::size_t>(i)];
    const double u = w.u0 + c.u - geometry_->cx, v = w.v0 + c.v - geometry_->cy;
    DisparitySums pixel;
    pixel.add(u, v, static_cast<double>(image_->row(w.v0 + c.v)[w.u0 + c.u]));
    if (c.from > 0) {
      sums_[c.from - 1U] -= pixel;
      --border.pixels[place[c.from]];
    }
    if (c.to > 0) {
      sums_[c.to - 1U] += pixel;
      ++border.pixels[place[c.to]];
    }
  }
  note_holders(border);
}

// Of a window's pixels with a mark.
DisparitySums PixelLabeller::sums_of(const Window& w, const Marks& all, std::uint8_t mark,
                                     const Eigen::Vector3f& plane) const {
  const double mid_v = w.v0 + 0.5 * (w.height - 1) - geometry_->cy;
  DisparitySums total;
  for (int u = 0; u < w.width; u += kRow) {
    const int width = std::min(kRow, w.width - u);
    const double mid_u = w.u0 + u + 0.5 * (kRow - 1) - geometry_->cx;
    const float shift =
        plane.dot(Eigen::Vector3f(static_cast<float>(mid_u), static_cast<float>(mid_v), 1));
    const float* d = image_->row(w.v0) + w.u0 + u;
    const std::uint8_t* marks = all.first + u;
    BlockSums sums;
    if (width == kRow) {
      sums = marked_sums8(d, image_->width, marks, all.stride, w.height, shift, mark);
    } else {
      std::vector<float> padded(kRow * static_cast<std::size_t>(w.height), 0.0F);
      std::vector<std::uint8_t> padded_marks(padded.size(), 0);
      for (int v = 0; v < w.height; ++v) {
        std::copy_n(d + std::ptrdiff_t{v} * image_->width, width, &padded[kRow * v]);
        std::copy_n(marks + std::ptrdiff_t{v} * all.stride, width, &padded_marks[kRow * v]);
      }
      sums = marked_sums8(padded.data(), kRow, padded_marks.data(), kRow, w.height, shift, mark);
    }
    total += to_sums(sums, mid_u, mid_v, static_cast<double>(shift));
  }
  return total;
}

// Planes from their own pixels alone; marks those that moved by more than `least` px. Thin faces
// creep, each pass by a share of what is left: `ahead` sends them there at once.
void PixelLabeller::refit(PlaneRegions& regions, double least, bool ahead) {
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    PlaneRegion& region = regions.regions()[k];
    region.sums = sums_[k];
    region.pixels = static_cast<std::int64_t>(std::llround(sums_[k].n));
    moved_[k] = 0;
    const auto fit = sums_[k].fit();
    if (!fit) continue;
    const DisparityPlane step = *fit - region.plane;
    // A large plane is not bent by its border.
    const bool small = sums_[k].n < kSmallShare * static_cast<double>(image_->d.size());
    moved_[k] = small && sums_[k].mean_square(step) > least * least;
    region.plane = *fit;
    if (ahead && moved_[k] != 0) region.plane += way_left(sums_[k], steps_[k], step) * step;
    steps_[k] = step;
  }
}

}  // namespace lamina
