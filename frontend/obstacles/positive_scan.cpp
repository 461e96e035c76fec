// Row by row with one slot a column, so that compilers make vectors of it.
#include <lamina/frontend/obstacles/positive_scan.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

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

// Is there anything in [from, to) between the tolerance and the top? Height is linear in 1 / d, so
// that the tests need no division: pz > a <=> (tz - a) d + fb z > 0.
bool anything(const float* d, int from, int to, const Row& r, const Limits& l) {
  const float low = l.tz - l.step, high = l.tz - l.top, noise = l.fb * l.noise_per_z;
  int found = 0;
  for (int u = from; u < to; ++u) {
    const float up = (r.z0 + r.dz * static_cast<float>(u)) * l.fb;
    found |= static_cast<int>(d[u] > 0) & static_cast<int>(low * d[u] + up >= 0) &
             static_cast<int>(l.tz * d[u] + up >= noise) & static_cast<int>(high * d[u] + up <= 0);
  }
  return found != 0;
}

// One row: squared horizontal range of obstacle pixels, kFar elsewhere; least over the chunk of the
// farthest of three rows.
void scan_row(const float* d, int from, int to, const Row& r, const Limits& l, float* now,
              const float* before, const float* before2, float* nearest, float* x, float* y,
              float* z) {
  for (int u = from; u < to; ++u) {
    const float fu = static_cast<float>(u);
    const float depth = l.fb / std::max(d[u], 1e-6F);
    const float px = (r.x0 + r.dx * fu) * depth + l.tx;
    const float py = (r.y0 + r.dy * fu) * depth + l.ty;
    const float pz = (r.z0 + r.dz * fu) * depth + l.tz;
    const float tolerance = std::max(l.step, l.noise_per_z * depth);
    const float range2 = px * px + py * py;
    const bool counts = (d[u] > 0) & (pz > tolerance) & (pz < l.top);
    const float value = counts ? range2 : kFar;
    now[u] = value;
    const float agreed = std::max(value, std::max(before[u], before2[u]));
    const bool best = agreed < nearest[u];
    nearest[u] = best ? agreed : nearest[u];
    x[u] = best ? px : x[u];
    y[u] = best ? py : y[u];
    z[u] = best ? depth : z[u];
  }
}

void mask_floor(const std::uint8_t* labels, int width, const std::vector<std::uint8_t>& free,
                float* now) {
  for (int u = 0; u < width; ++u) {
    if (free[labels[u]]) now[u] = kFar;
  }
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

}  // namespace

void positive_scan(const ScanView& view, std::span<const std::uint8_t> labels,
                   const WalkPlanes& planes, const ScanOptions& options, PositiveBuffers& b,
                   ObstacleScan& out) {
  const int width = view.image->width;
  const std::size_t n = static_cast<std::size_t>(width);
  b.nearest.assign(n, kFar);
  for (auto* v : {&b.x, &b.y, &b.z}) v->assign(n, 0);
  for (auto* v : {&b.before, &b.before2, &b.before3}) v->assign(n, kFar);
  // Levels and ramps a walk went over; the dominant floor is within the tolerance anyway.
  std::vector<std::uint8_t> free(256, 0);
  bool any_free = false;
  for (std::size_t k = 0; k < planes.of_label.size() && !labels.empty(); ++k) {
    const int p = planes.of_label[k];
    if (p < 0 || !planes.planes[static_cast<std::size_t>(p)].entered) continue;
    free[k] = 1;
    any_free |= p > 0;
  }
  const double h = view.height();
  const Limits limits{
      static_cast<float>(options.max_step_m),
      static_cast<float>(options.noise_sigmas * h *
                         std::hypot(view.noise.disparity_sigma, view.noise.disparity_floor) /
                         view.noise.focal_baseline),
      static_cast<float>(options.robot_height_m),
      static_cast<float>(view.noise.focal_baseline),
      static_cast<float>(view.t.x()),
      static_cast<float>(view.t.y()),
      static_cast<float>(view.t.z())};
  const Eigen::Vector3f du = (view.R.col(0) / view.fx).cast<float>();
  const int chunks = (width + kChunkColumns - 1) / kChunkColumns;
  std::vector<char> any[3];
  for (auto& a : any) a.assign(static_cast<std::size_t>(chunks), 0);
  std::vector<char>*now_any = &any[0], *before_any = &any[1], *before2_any = &any[2];
  std::vector<float>*now = &b.before3, *before = &b.before, *before2 = &b.before2;
  for (int v = 0; v < view.image->height; ++v) {
    const Eigen::Vector3f r0 = view.ray(0, v).cast<float>();
    const Row row{r0.x(), r0.y(), r0.z(), du.x(), du.y(), du.z()};
    const float* d = view.image->row(v);
    for (int c = 0; c < chunks; ++c) {
      const int from = c * kChunkColumns, to = std::min(width, from + kChunkColumns);
      char& mine = (*now_any)[static_cast<std::size_t>(c)];
      const bool was = mine != 0;  // three rows ago: to be wiped
      mine = anything(d, from, to, row, limits);
      if (mine != 0 || (*before_any)[static_cast<std::size_t>(c)] != 0 ||
          (*before2_any)[static_cast<std::size_t>(c)] != 0) {
        scan_row(d, from, to, row, limits, now->data(), before->data(), before2->data(),
                 b.nearest.data(), b.x.data(), b.y.data(), b.z.data());
      } else if (was) {
        std::fill(now->begin() + from, now->begin() + to, kFar);
      }
    }
    if (any_free)
      mask_floor(labels.data() + static_cast<std::size_t>(v) * n, width, free, now->data());
    std::vector<float>* oldest = before2;
    before2 = before;
    before = now;
    now = oldest;
    std::vector<char>* oldest_any = before2_any;
    before2_any = before_any;
    before_any = now_any;
    now_any = oldest_any;
    if ((v + 1) % kChunkRows == 0 || v + 1 == view.image->height) {
      scatter(view, b, out);
      std::fill(b.nearest.begin(), b.nearest.end(), kFar);
    }
  }
}

}  // namespace lamina
