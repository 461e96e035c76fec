// Row by row with one slot a column, four columns at a time.
#include <lamina/frontend/obstacles/positive_scan.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/lanes.hpp>

namespace lamina {
namespace {

using namespace lanes;

// Rows between two looks at the columns: a rolled camera's columns lean less than a few pixels.
constexpr int kChunkRows = 16;
// Columns looked at together: where three rows hold nothing, nothing is worked out.
constexpr int kChunkColumns = 32;
constexpr float kFar = 1e12F;

struct Row {
  float x0, y0, z0;  // body direction per metre of depth at column 0
  float dx, dy, dz;  // and its change a column
};

struct Limits {
  float step, noise_per_z, top, fb;
  float tx, ty, tz;
};

// What is kept of every column, from the first of a chunk on.
struct Columns {
  float *now, *before, *before2;  // squared ranges of obstacle pixels in three rows; kFar: none
  float *nearest, *x, *y, *z;     // of the nearest of a few rows: squared range, place, depth
};

// Arithmetic on one float or on four side by side: the same steps in the same order.
inline Float4 first_columns(int u, Float4) { return static_cast<float>(u) + Float4{0, 1, 2, 3}; }
inline float first_columns(int u, float) { return static_cast<float>(u); }
inline Float4 larger(const Float4& a, const Float4& b) { return a > b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }
inline Float4 chosen(const Int4& which, const Float4& a, const Float4& b) { return which ? a : b; }
inline float chosen(bool which, float a, float b) { return which ? a : b; }
inline void load(const float* p, Float4& x) { x = load4(p); }
inline void load(const float* p, float& x) { x = *p; }
inline void store(float* p, const Float4& x) { store4(p, x); }
inline void store(float* p, float x) { *p = x; }

// Is there anything between the tolerance and the top? Height is linear in 1 / d, so that the tests
// need no division: pz > a <=> (tz - a) d + fb z > 0.
template <class Lanes>
auto is_above(const Lanes& d, const Lanes& fu, const Row& r, const Limits& l) {
  const Lanes scaled = l.tz * d + (r.z0 * l.fb + r.dz * l.fb * fu);
  return (scaled >= l.step * d) & (scaled >= l.fb * l.noise_per_z) & (scaled <= l.top * d);
}

// Pixels at column u: squared horizontal range of obstacle pixels, kFar elsewhere; nearest: the
// least of the farthest of three rows. `at`: from the first column of the chunk.
template <class Lanes>
void scan_pixels(const float* from, int u, int at, const Row& r, const Limits& l,
                 const Columns& c) {
  Lanes d, b, b2, nearest, x, y, z;
  load(from, d);
  load(c.before + at, b);
  load(c.before2 + at, b2);
  load(c.nearest + at, nearest);
  load(c.x + at, x);
  load(c.y + at, y);
  load(c.z + at, z);
  const Lanes fu = first_columns(u, d);
  const Lanes depth = l.fb / larger(d, 1e-6F + Lanes{});
  const Lanes px = (r.x0 + r.dx * fu) * depth + l.tx;
  const Lanes py = (r.y0 + r.dy * fu) * depth + l.ty;
  const Lanes pz = (r.z0 + r.dz * fu) * depth + l.tz;
  const Lanes tolerance = larger(l.noise_per_z * depth, l.step + Lanes{});
  const auto counts = (d > 0.0F) & (pz > tolerance) & (pz < l.top);
  const Lanes value = chosen(counts, px * px + py * py, kFar + Lanes{});
  const Lanes agreed = larger(value, larger(b, b2));
  const auto best = agreed < nearest;
  store(c.now + at, value);
  store(c.nearest + at, chosen(best, agreed, nearest));
  store(c.x + at, chosen(best, px, x));
  store(c.y + at, chosen(best, py, y));
  store(c.z + at, chosen(best, depth, z));
}

// A chunk's pixels, those of levels and ramps that were walked on taken out.
void copy_masked(const float* d, const std::uint8_t* labels, int count,
                 const std::array<std::uint8_t, 256>& free, float* out) {
  for (int k = 0; k < count; ++k) out[k] = free[labels[k]] != 0 ? 0.0F : d[k];
}

bool anything(const float* d, int from, int count, const Row& r, const Limits& l, Pace pace) {
  bool found = false;
  int k = 0;
  if (pace == Pace::kStrides) {
    Int4 four{};
    Float4 fu = first_columns(from, Float4{});
    for (; k + 4 <= count; k += 4, fu += 4) four |= is_above(load4(d + k), fu, r, l);
    found = any4(four);
  }
  for (; k < count; ++k) found |= is_above(d[k], static_cast<float>(from + k), r, l);
  return found;
}

void scan_chunk(const float* d, int from, int count, const Row& r, const Limits& l,
                const Columns& columns, Pace pace) {
  int k = 0;
  if (pace == Pace::kStrides) {
    for (; k + 4 <= count; k += 4) scan_pixels<Float4>(d + k, from + k, k, r, l, columns);
  }
  for (; k < count; ++k) scan_pixels<float>(d + k, from + k, k, r, l, columns);
}

void scatter(const ScanView& view, const PositiveBuffers& b, ObstacleScan& out) {
  const float from = static_cast<float>(out.angle_min);
  const float per_rad = static_cast<float>(1 / out.angle_increment);
  const float turn = 6.2831853F, low = -0.5F / per_rad;
  for (std::size_t u = 0; u < b.nearest.size(); ++u) {
    if (!(b.nearest[u] < kFar)) continue;
    float offset = quick_atan2(b.y[u], b.x[u]) - from;
    if (offset < low) offset += turn;
    if (offset >= turn + low) offset -= turn;
    const int beam = static_cast<int>(offset * per_rad + 0.5F);
    if (beam < 0 || beam >= static_cast<int>(out.size())) continue;
    const std::size_t k = static_cast<std::size_t>(beam);
    const float range = std::sqrt(b.nearest[u]);
    if (out.cause[k] == BeamCause::kObstacle && out.range[k] <= range) continue;
    if (static_cast<double>(range) > out.range_max) continue;
    out.range[k] = range;
    out.cause[k] = BeamCause::kObstacle;
    const double depth = static_cast<double>(b.z[u]);
    out.sigma[k] = static_cast<float>(
        std::hypot(view.noise.sigma_depth(depth), view.noise.correlated_floor(depth)));
  }
}

Limits limits_of(const ScanView& view, const ScanOptions& options) {
  const double noise = std::hypot(view.noise.disparity_sigma, view.noise.disparity_floor);
  return {
      static_cast<float>(options.max_step_m),
      static_cast<float>(options.noise_sigmas * view.height() * noise / view.noise.focal_baseline),
      static_cast<float>(options.robot_height_m),
      static_cast<float>(view.noise.focal_baseline),
      static_cast<float>(view.t.x()),
      static_cast<float>(view.t.y()),
      static_cast<float>(view.t.z())};
}

// Labels of the floor and of levels and ramps a walk went over. Of the floor alone nothing need be
// taken out: it is within the tolerance.
struct FreeLabels {
  std::array<std::uint8_t, 256> free{};
  bool any = false;

  FreeLabels(const WalkPlanes& planes, bool labelled) {
    for (std::size_t k = 0; k < planes.of_label.size() && k < free.size() && labelled; ++k) {
      const int p = planes.of_label[k];
      if (p < 0 || !planes.planes[static_cast<std::size_t>(p)].entered) continue;
      free[k] = 1;
      any |= p > 0;
    }
  }
};

}  // namespace

void positive_scan(const ScanView& view, std::span<const std::uint8_t> labels,
                   const WalkPlanes& planes, const ScanOptions& options, PositiveBuffers& b,
                   ObstacleScan& out, Pace pace) {
  const int width = view.image->width;
  const std::size_t n = static_cast<std::size_t>(width);
  b.nearest.assign(n, kFar);
  for (auto* v : {&b.x, &b.y, &b.z}) v->assign(n, 0);
  for (auto* v : {&b.before, &b.before2, &b.before3}) v->assign(n, kFar);
  const int chunks = (width + kChunkColumns - 1) / kChunkColumns;
  for (auto& busy : b.busy) busy.assign(static_cast<std::size_t>(chunks), 0);
  const FreeLabels walked(planes, !labels.empty());
  const Limits limits = limits_of(view, options);
  const Eigen::Vector3f du = (view.R.col(0) / view.fx).cast<float>();
  std::vector<float>*now = &b.before3, *before = &b.before, *before2 = &b.before2;
  for (int v = 0; v < view.image->height; ++v) {
    const Eigen::Vector3f r0 = view.ray(0, v).cast<float>();
    const Row row{r0.x(), r0.y(), r0.z(), du.x(), du.y(), du.z()};
    for (int c = 0; c < chunks; ++c) {
      const int from = c * kChunkColumns, count = std::min(width - from, kChunkColumns);
      const float* d = view.image->row(v) + from;
      std::array<float, kChunkColumns> masked;
      char& mine = b.busy[0][static_cast<std::size_t>(c)];
      const bool was = mine != 0;  // three rows ago: to be wiped
      mine = anything(d, from, count, row, limits, pace);
      if (mine != 0 && walked.any) {
        const std::size_t at = static_cast<std::size_t>(v) * n + static_cast<std::size_t>(from);
        copy_masked(d, labels.data() + at, count, walked.free, masked.data());
        d = masked.data();
        mine = anything(d, from, count, row, limits, pace);
      }
      // Where three rows hold nothing, nothing is worked out.
      if (mine != 0) {
        scan_chunk(
            d, from, count, row, limits,
            {now->data() + from, before->data() + from, before2->data() + from,
             b.nearest.data() + from, b.x.data() + from, b.y.data() + from, b.z.data() + from},
            pace);
      } else if (was) {
        std::fill(now->begin() + from, now->begin() + from + count, kFar);
      }
    }
    std::swap(before2, now);  // the oldest row is written next
    std::swap(before, before2);
    std::rotate(b.busy.begin(), b.busy.end() - 1, b.busy.end());
    if ((v + 1) % kChunkRows == 0 || v + 1 == view.image->height) {
      scatter(view, b, out);
      std::fill(b.nearest.begin(), b.nearest.end(), kFar);
    }
  }
}

}  // namespace lamina
