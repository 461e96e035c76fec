// Rims that go on where only a little shows: hysteresis along the image.
#include <algorithm>
#include <cmath>

#include <lamina/frontend/obstacles/floor_walk.hpp>

namespace lamina {
namespace {

constexpr int kBefore = 8, kBehind = 3;  // samples of floor before the rim, of ground behind it
constexpr float kSigmas = 3.5F;
constexpr float kLateral = 0.5F;  // px [Barron2013]

// Residuals of one line's pixels against a floor (px of disparity; NaN: missing).
class Profile {
 public:
  Profile(const ScanView& view, const WalkLine& line, const WalkPlane& plane)
      : view_(view), line_(line), plane_(plane) {
    const Eigen::Vector2d out(std::cos(line.azimuth), std::sin(line.azimuth));
    const double u = static_cast<double>(line.u0), v = static_cast<double>(line.v0);
    outward0_ = view.ray(u, v).head<2>().dot(out);
    outward_step_ = view.ray(u + static_cast<double>(line.du), v + static_cast<double>(line.dv))
                        .head<2>()
                        .dot(out) -
                    outward0_;
  }

  double range(double i) const {
    const double d = static_cast<double>(expected(static_cast<float>(i)));
    return d > 1e-9 ? view_.noise.focal_baseline / d * (outward0_ + i * outward_step_) : 1e9;
  }
  /// First sample beyond a range: ranges grow along the line.
  int sample_at(double range_m) const {
    int low = 0, high = line_.samples;
    while (low < high) {
      const int middle = (low + high) / 2;
      if (range(middle) < range_m) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }
  /// How far the mean of `kBehind` samples from `i` on lies below the `kBefore` before it, in
  /// sigmas; 0 where too little was seen.
  float drop(int i) const {
    float before = 0, behind = 0;
    int n = 0, m = 0;
    for (int k = i - kBefore; k < i; ++k) add(k, before, n);
    for (int k = i; k < i + kBehind; ++k) add(k, behind, m);
    if (2 * n < kBefore || m < 2) return 0;
    // Neighbours along the line share their noise: three of them are one.
    const float own = static_cast<float>(view_.noise.disparity_sigma);
    const float slope = plane_.disparity.x() * line_.du + plane_.disparity.y() * line_.dv;
    const float aside = kLateral * slope;
    const float variance = own * own + aside * aside / static_cast<float>(m);
    return (before / static_cast<float>(n) - behind / static_cast<float>(m)) / std::sqrt(variance);
  }

 private:
  float expected(float i) const {
    const float u = line_.u0 + i * line_.du - static_cast<float>(view_.cx);
    const float v = line_.v0 + i * line_.dv - static_cast<float>(view_.cy);
    return plane_.disparity.x() * u + plane_.disparity.y() * v + plane_.disparity.z();
  }
  void add(int i, float& sum, int& n) const {
    if (i < 0 || i >= line_.samples) return;
    const float fi = static_cast<float>(i);
    const int u = static_cast<int>(line_.u0 + fi * line_.du + 0.5F);
    const int v = static_cast<int>(line_.v0 + fi * line_.dv + 0.5F);
    const float d = view_.image->row(v)[u];
    if (!(d > 0)) return;
    const float fu = static_cast<float>(u) - static_cast<float>(view_.cx);
    const float fv = static_cast<float>(v) - static_cast<float>(view_.cy);
    sum += d - (plane_.disparity.x() * fu + plane_.disparity.y() * fv + plane_.disparity.z());
    ++n;
  }

  const ScanView& view_;
  const WalkLine& line_;
  const WalkPlane& plane_;
  double outward0_ = 0, outward_step_ = 0;
};

// Tries to carry the rim of `from` on to the line of `to`.
bool carry(const Profile& profile, double expected_range, const WalkEnd& from, WalkEnd& to) {
  const int middle = profile.sample_at(expected_range);
  int best = -1;
  float most = kSigmas;
  for (int i = middle - 2; i <= middle + 2; ++i) {
    const float drop = profile.drop(i);
    if (drop > most) {
      most = drop;
      best = i;
    }
  }
  if (best < 0) return false;
  to.cause = from.cause;
  to.range = profile.range(best - 0.5);
  to.footprint = profile.range(best) - profile.range(best - 1);
  to.height = from.height;
  to.plane = from.plane;
  to.sample = best - 1;
  to.faded = from.faded;
  return true;
}

// A rim's end is known to half a footprint like the rim itself: over that much more it is taken to
// go on straight. Only from rims of several lines.
constexpr int kFirm = 8;

int lines_of_half_a_footprint(const WalkEnd& end, double line_step) {
  return static_cast<int>(0.5 * end.footprint / std::max(1e-6, end.range * line_step));
}

// Holes narrower than any wheel are specks of the matcher, unless the image's border cuts them.
constexpr double kNarrowest = 0.03;  // m

void drop_narrow(double line_step, std::vector<WalkEnd>& ends) {
  const std::size_t n = ends.size();
  for (std::size_t j = 0, k = 0; j < n; j = std::max(k, j + 1)) {
    double width = 0;
    for (k = j; k < n && is_negative(ends[k].cause); ++k) width += ends[k].range * line_step;
    if (k == j || j == 0 || k == n || width >= kNarrowest) continue;
    for (std::size_t i = j; i < k; ++i) ends[i].cause = BeamCause::kEdgeOfKnowledge;
  }
}

}  // namespace

void grow_rims(const ScanView& view, const std::vector<WalkLine>& lines, const WalkPlanes& planes,
               std::vector<WalkEnd>& ends) {
  const auto at = [](std::ptrdiff_t j) { return static_cast<std::size_t>(j); };
  const std::ptrdiff_t n = static_cast<std::ptrdiff_t>(ends.size());
  if (n < 2) return;
  const double line_step = std::abs(lines[1].azimuth - lines[0].azimuth);
  const auto pass = [&](std::ptrdiff_t first, std::ptrdiff_t last, std::ptrdiff_t way) {
    int firm = 0, on = -1;  // lines of rim so far; lines it may still go on unseen, -1: any number
    for (std::ptrdiff_t j = first; j != last; j += way) {
      const WalkEnd& from = ends[at(j)];
      WalkEnd& to = ends[at(j + way)];
      if (!is_negative(from.cause) || from.sample < 0) {
        firm = 0, on = -1;
        continue;
      }
      ++firm;
      if (is_negative(to.cause)) {
        on = -1;
        continue;
      }
      if (to.sample < 0 || lines[at(j + way)].samples == 0) continue;
      // Only where the floor was walked on past the rim, or ended about there.
      if (to.range < from.range - 3 * from.footprint) continue;
      double expected = from.range;
      if (j - way >= 0 && j - way < n) {
        const WalkEnd& old = ends[at(j - way)];
        const double step = from.range - old.range;
        if (is_negative(old.cause) && std::abs(step) < 2 * from.footprint) expected += step;
      }
      const WalkPlane& plane = planes.planes[at(from.plane)];
      if (on < 0 && carry(Profile(view, lines[at(j + way)], plane), expected, from, to)) continue;
      if (on < 0) on = firm >= kFirm ? lines_of_half_a_footprint(from, line_step) : 0;
      if (on-- == 0) {
        firm = 0, on = -1;
        continue;
      }
      to.cause = from.cause;
      to.range = expected;
      to.footprint = from.footprint;
      to.height = from.height;
      to.plane = from.plane;
    }
  };
  pass(0, n - 1, 1);
  pass(n - 1, 0, -1);
  drop_narrow(line_step, ends);
}

}  // namespace lamina
