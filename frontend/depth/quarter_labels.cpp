// Majorities of quarters, and what of them is left of a border that is not sure.
#include <lamina/frontend/depth/quarter_labels.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <lamina/frontend/depth/inner_blocks.hpp>

namespace lamina {
namespace {

struct Rectangle {
  int u0, v0, u1, v1;  // px, u1 and v1 beyond it
  int size() const { return (u1 - u0) * (v1 - v0); }
};

int measured_in(const DisparityImage& image, const Rectangle& r) {
  int n = 0;
  for (int v = r.v0; v < r.v1; ++v) {
    const float* d = image.row(v);
    for (int u = r.u0; u < r.u1; ++u) n += d[u] > 0;
  }
  return n;
}

// The label of one quarter, -1: none.
std::int16_t label_of(const DisparityImage& image, std::span<const std::uint8_t> marks,
                      const Rectangle& r) {
  const auto row = [&](int v) {
    return marks.data() + static_cast<std::ptrdiff_t>(v) * image.width;
  };
  // Where all is of one kind, nothing is to be counted.
  const std::uint8_t first = row(r.v0)[r.u0];
  const std::size_t width = static_cast<std::size_t>(r.u1 - r.u0);
  bool alike = std::all_of(row(r.v0) + r.u0, row(r.v0) + r.u1, [&](auto m) { return m == first; });
  for (int v = r.v0 + 1; alike && v < r.v1; ++v) {
    alike = std::memcmp(row(v) + r.u0, row(r.v0) + r.u0, width) == 0;
  }
  if (alike) return static_cast<std::int16_t>(first - 1);

  const int measured = measured_in(image, r);
  std::uint8_t last = 0;  // counted already
  for (int v = r.v0; v < r.v1; ++v) {
    for (int u = r.u0; u < r.u1; ++u) {
      const std::uint8_t mark = row(v)[u];
      if (mark == 0 || mark == last) continue;
      last = mark;
      int n = 0;
      for (int y = r.v0; y < r.v1; ++y) {
        n += static_cast<int>(std::count(row(y) + r.u0, row(y) + r.u1, mark));
      }
      if (2 * n < measured) continue;
      return 4 * n >= r.size() ? static_cast<std::int16_t>(mark - 1) : std::int16_t{-1};
    }
  }
  return -1;
}

// How many quarters each label has, and how many of these stay.
struct Share {
  int all = 0, kept = 0;
  bool most() const { return 2 * kept > all; }
};

// Takes the quarters away that do not stay, of labels of which most do.
void drop(QuarterLabels& quarters, const std::vector<std::uint8_t>& stays) {
  std::vector<Share> shares;
  for (std::size_t i = 0; i < quarters.labels.size(); ++i) {
    if (quarters.labels[i] < 0) continue;
    const std::size_t k = static_cast<std::size_t>(quarters.labels[i]);
    if (k >= shares.size()) shares.resize(k + 1);
    ++shares[k].all;
    shares[k].kept += stays[i];
  }
  for (std::size_t i = 0; i < quarters.labels.size(); ++i) {
    std::int16_t& label = quarters.labels[i];
    if (label >= 0 && !stays[i] && shares[static_cast<std::size_t>(label)].most()) label = -1;
  }
}

// The disparity below which `px` of the image span more than `span` m of the plane. At disparity d,
// depth Z = F / d (F: focal length times baseline), they span px Z / f by the image's scale and
// about px Z |slope| / d by the depth's change.
double coarse_below(const ExtractedPlane& plane, const DisparityGeometry& g, double px,
                    double span) {
  const double scale = px * g.focal_baseline / g.fx;
  const double depth = px * g.focal_baseline * plane.disparity.head<2>().norm();
  return (scale + std::sqrt(scale * scale + 4 * span * depth)) / (2 * span);
}

}  // namespace

QuarterLabels quarter_labels(const DisparityImage& image, const BlockImage& blocks,
                             std::span<const std::int16_t> block_labels,
                             std::span<const std::uint8_t> pixel_labels) {
  QuarterLabels q;
  if (block_labels.empty()) return q;  // nothing was labelled
  q.block_px = blocks.size;
  q.columns = 2 * blocks.columns;
  q.rows = 2 * blocks.rows;
  q.labels.assign(static_cast<std::size_t>(q.columns) * static_cast<std::size_t>(q.rows), -1);
  std::vector<std::int16_t> inner, scratch;
  find_inner(block_labels, static_cast<std::size_t>(blocks.columns), inner, scratch);
  for (int r = 0; r < q.rows; ++r) {
    for (int c = 0; c < q.columns; ++c) {
      const std::int16_t block = inner[static_cast<std::size_t>(blocks.index(c / 2, r / 2))];
      const Rectangle at{q.first_px(c), q.first_px(r), std::min(image.width, q.first_px(c + 1)),
                         std::min(image.height, q.first_px(r + 1))};
      if (at.u0 >= at.u1 || at.v0 >= at.v1) continue;
      q.at(c, r) = block >= 0 ? block : label_of(image, pixel_labels, at);
    }
  }
  return q;
}

void prune_thin_borders(QuarterLabels& quarters) {
  std::vector<std::uint8_t> stays(quarters.labels.size(), 0);
  const std::size_t columns = static_cast<std::size_t>(quarters.columns);
  std::vector<std::uint8_t> square(columns, 0);  // two by two of one label, from here on
  for (int r = 0; r + 1 < quarters.rows; ++r) {  // whole rows at once
    const std::int16_t* const upper = quarters.labels.data() + quarters.index(0, r);
    const std::int16_t* const lower = upper + columns;
    for (std::size_t c = 0; c + 1 < columns; ++c) {
      square[c] = (upper[c] == upper[c + 1]) & (upper[c] == lower[c]) & (upper[c] == lower[c + 1]);
    }
    for (std::uint8_t* const stay :
         {stays.data() + quarters.index(0, r), stays.data() + quarters.index(0, r + 1)}) {
      for (std::size_t c = 0; c + 1 < columns; ++c) stay[c] |= square[c];
      for (std::size_t c = 0; c + 1 < columns; ++c) stay[c + 1] |= square[c];
    }
  }
  drop(quarters, stays);
}

void drop_coarse(QuarterLabels& quarters, std::span<const ExtractedPlane> planes,
                 const DisparityGeometry& g) {
  constexpr double kCoarse = 0.3;  // m of the plane
  const double px = quarters.block_px / 2.0;
  std::vector<double> least(planes.size(), 0);  // px of disparity
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (planes[k].slope >= kUprightSlope) least[k] = coarse_below(planes[k], g, px, kCoarse);
  }
  std::vector<std::uint8_t> stays(quarters.labels.size(), 1);
  for (int r = 0; r < quarters.rows; ++r) {
    for (int c = 0; c < quarters.columns; ++c) {
      const std::int16_t k = quarters.at(c, r);
      if (k < 0 || least[static_cast<std::size_t>(k)] == 0) continue;
      const Eigen::Vector3d middle(quarters.first_px(c) + 0.5 * (px - 1) - g.cx,
                                   quarters.first_px(r) + 0.5 * (px - 1) - g.cy, 1);
      const std::size_t plane = static_cast<std::size_t>(k);
      stays[quarters.index(c, r)] = planes[plane].disparity.dot(middle) >= least[plane];
    }
  }
  drop(quarters, stays);
}

}  // namespace lamina
