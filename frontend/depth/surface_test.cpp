// Runs along rows and columns, and what lies beside their ends.
#include <lamina/frontend/depth/surface_test.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace lamina {
namespace {

constexpr int kLook = 48;  // px: how far over missing pixels (shadows) to look for a neighbour
// px: missing ones in a row over which a run goes on. What was not measured is no end of a surface;
// more than a block's side is a gap between two things.
constexpr int kHole = 8;

// A row or a column of the image; the marks side by side.
struct Line {
  const float* d;
  std::ptrdiff_t stride;  ///< of the disparities
  const std::uint8_t* marks;
  int length;
  double slope, start;  ///< of the region's disparity along the line: set for each run

  float disparity(int i) const { return d[i * stride]; }
  std::uint8_t mark(int i) const { return marks[i]; }
  /// The first place from `i` on whose mark is another, give or take: never beyond it.
  int skip(int i, std::uint8_t mark) const {
    const std::uint64_t same = 0x0101010101010101ULL * mark;
    std::uint64_t eight;
    for (; i + 8 <= length; i += 8) {
      std::memcpy(&eight, marks + i, sizeof(eight));
      if (eight != same) break;
    }
    return i;
  }
};

// Marks of every `step`-th column, one column after the other.
std::vector<std::uint8_t> columns_of(const std::vector<std::uint8_t>& marks, int width, int height,
                                     int step) {
  const std::size_t length = static_cast<std::size_t>(height);
  const int first = step / 2;
  const std::size_t count = static_cast<std::size_t>(std::max(0, width - first + step - 1) / step);
  std::vector<std::uint8_t> columns(count * length);
  if (columns.empty()) return columns;
  const std::uint8_t* row = marks.data();
  for (std::size_t v = 0; v < length; ++v, row += width) {
    std::uint8_t* to = columns.data() + v;
    for (int u = first; u < width; u += step, to += length) *to = row[u];
  }
  return columns;
}

// Whether the first measurement beyond an end lies behind the plane; the image's border does not.
bool is_open(const Line& line, int end, int direction, float gate) {
  for (int k = 1; k <= kLook; ++k) {
    const int i = end + direction * k;
    if (i < 0 || i >= line.length) return false;
    const float d = line.disparity(i);
    // The pixels right at the edge mix both surfaces.
    if (!(d > 0) || k < 3) continue;
    return d < static_cast<float>(line.start + line.slope * i) - gate;
  }
  return false;
}

template <class PlaneAlong, class Take>
void scan(Line& line, const PlaneAlong& plane_along, float gate, const Take& take) {
  for (int i = 0; i < line.length;) {
    const std::uint8_t mark = line.mark(i);
    if (mark == 0) {
      i = std::max(i + 1, line.skip(i, 0));
      continue;
    }
    int end = std::max(i + 1, line.skip(i, mark));
    int others = 0, missing = 0;  // single pixels of another label do not end a run
    for (int k = end; k < line.length && others < 2 && missing <= kHole; ++k) {
      if (line.mark(k) == mark) {
        k = std::max(k, line.skip(k, mark) - 1);
        end = k + 1;
        others = missing = 0;
      } else if (line.disparity(k) > 0) {
        ++others;
      } else {
        ++missing;
      }
    }
    plane_along(mark, line);
    const bool open = is_open(line, i, -1, gate) && is_open(line, end - 1, 1, gate);
    take(mark, end - i, open);
    i = end;
  }
}

}  // namespace

std::vector<RegionEvidence> gather_evidence(const DisparityImage& image, const DisparityGeometry& g,
                                            const std::vector<std::uint8_t>& pixel_labels,
                                            const std::vector<PlaneRegion>& regions, int step,
                                            float gate) {
  std::vector<RegionEvidence> evidence(regions.size());
  const auto add = [](RunEvidence& runs, int length, bool open) {
    runs.runs += 1;
    runs.free_runs += open ? 1 : 0;
    runs.pixels += length;
  };
  for (int v = step / 2; v < image.height; v += step) {
    Line line{image.row(v), 1, pixel_labels.data() + static_cast<std::ptrdiff_t>(v) * image.width,
              image.width,  0, 0};
    const auto along = [&](std::uint8_t mark, Line& l) {
      const DisparityPlane& p = regions[mark - 1U].plane;
      l.slope = p.x();
      l.start = p.z() + p.y() * (v - g.cy) - p.x() * g.cx;
    };
    scan(line, along, gate, [&](std::uint8_t mark, int length, bool open) {
      add(evidence[mark - 1U].across, length, open);
    });
  }
  const auto columns = columns_of(pixel_labels, image.width, image.height, step);
  const std::uint8_t* column = columns.data();
  for (int u = step / 2; u < image.width; u += step) {
    Line line{image.d.data() + u, image.width, column, image.height, 0, 0};
    column += image.height;
    const auto along = [&](std::uint8_t mark, Line& l) {
      const DisparityPlane& p = regions[mark - 1U].plane;
      l.slope = p.y();
      l.start = p.z() + p.x() * (u - g.cx) - p.y() * g.cy;
    };
    scan(line, along, gate, [&](std::uint8_t mark, int length, bool open) {
      add(evidence[mark - 1U].down, length, open);
    });
  }
  return evidence;
}

bool is_surface(const RegionEvidence& evidence, double misfit) {
  // Pixels. A wall seen between posts is 10 to 20 wide; blocks are 8.
  constexpr double kNarrow = 32, kThin = 12;
  // Surfaces score 1.0 to 1.3, a little more where their rims are ragged.
  constexpr double kBent = 1.2, kRagged = 1.3, kMixed = 1.45;
  const double across = evidence.across.length(), down = evidence.down.length();
  if (std::min(across, down) >= kNarrow) return true;
  if (misfit > (std::max(across, down) < kThin ? kRagged : kMixed)) return false;
  for (const RunEvidence* runs : {&evidence.across, &evidence.down}) {
    if (runs->runs < 3 || runs->length() >= kNarrow || runs->free_share() < 0.4) continue;
    if (runs->length() < kThin || misfit > kBent) return false;
  }
  return true;
}

double misfit(const PlaneRegion& region, const BlockNoise& noise) {
  const double jitter = static_cast<double>(
      jitter_variance(static_cast<float>(region.plane.x()), static_cast<float>(region.plane.y())));
  const double expected = noise.pixel + jitter;
  return std::sqrt(region.sums.sse(region.plane) / std::max(1.0, region.sums.n) / expected);
}

}  // namespace lamina
