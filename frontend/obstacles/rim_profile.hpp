// One line's pixels about a rim: internal to grow_rims.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/frontend/obstacles/floor_walk.hpp>

namespace lamina {

/// One line's pixels against the floors of the frame.
class RimProfile {
 public:
  /// Samples of floor before the rim, of ground behind it.
  static constexpr int kBefore = 16, kShort = 3, kBehind = 5;
  static constexpr float kSigmas = 3.5F;

  /// `floor`: the one the rim ends, an index into `planes`; ranges are on it.
  RimProfile(const ScanView& view, const WalkLine& line, const WalkPlanes& planes, int floor)
      : view_(view),
        line_(line),
        planes_(planes),
        plane_(planes.planes[static_cast<std::size_t>(floor)]) {
    const double u = static_cast<double>(line.u0), v = static_cast<double>(line.v0);
    outward0_ = view.ray(u, v).head<2>().dot(line.direction);
    outward_step_ = view.ray(u + static_cast<double>(line.du), v + static_cast<double>(line.dv))
                        .head<2>()
                        .dot(line.direction) -
                    outward0_;
  }

  double range(double i) const {
    const double d = static_cast<double>(expected(static_cast<float>(i)));
    const double outward = std::max(0.0, outward0_ + i * outward_step_);
    return d > 1e-9 ? view_.noise.focal_baseline / d * outward : 1e9;
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
  /// Is there floor from sample i on: most of the next were seen, and lie as high as those before?
  bool is_floor(int i) const {
    float behind = 0;
    int m = 0;
    for (int k = i; k < i + kBehind; ++k) add(plane_, k, behind, m);
    return 2 * m > kBehind && std::abs(drop(i, kBehind)) < kSame;
  }
  /// How far the mean of `count` samples from `i` on lies below the `kBefore` before it, in
  /// sigmas; 0 where too little was seen. A slope is no drop: both are held against the floor of
  /// the frame nearest to those before and against that nearest to those behind (at the foot, the
  /// sides and the crest of a ramp two), and the lesser drop counts.
  float drop(int i, int count) const {
    constexpr float kNone = std::numeric_limits<float>::infinity();
    float off_before = kNone, off_behind = kNone, by_before = 0, by_behind = 0;
    for (const WalkPlane& plane : planes_.planes) {
      const Drop there = drop(plane, i, count);
      if (!there.seen) return 0;
      const float sigmas = (there.before - there.behind) / there.sigma;
      if (std::abs(there.before) < off_before)
        off_before = std::abs(there.before), by_before = sigmas;
      if (std::abs(there.behind) < off_behind)
        off_behind = std::abs(there.behind), by_behind = sigmas;
    }
    if ((by_before > 0) != (by_behind > 0)) return 0;
    return std::abs(by_before) < std::abs(by_behind) ? by_before : by_behind;
  }
  /// The floor of the frame nearest to the samples before i, an index into the planes.
  int floor_before(int i) const {
    int nearest = 0;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t k = 0; k < planes_.planes.size(); ++k) {
      const float off = std::abs(drop(planes_.planes[k], i, kBehind).before);
      if (off < least) least = off, nearest = static_cast<int>(k);
    }
    return nearest;
  }
  /// m, body z of the floor at a range (0: by the tracked mounting).
  float height(double range_m) const {
    const Eigen::Vector2d xy = view_.t.head<2>() + line_.direction * range_m;
    return plane_.body.dot(Eigen::Vector3d(xy.x(), xy.y(), 1).cast<float>());
  }
  RimProfile on(int floor) const { return {view_, line_, planes_, floor}; }
  /// m from the last sample before i that was measured to the first from there on.
  double unseen(int i) const {
    int last = i - 1, first = i;
    while (last > i - kBefore && !measured(last)) --last;
    while (first < i + kBehind && !measured(first)) ++first;
    return range(first) - range(last);
  }
  /// The longest way (m) across a pit's corner that may show no drop: the ground below it lies
  /// c h / range lower at the rim and nothing lower where the way ends, half that in the mean, of
  /// which noise hides kSigmas; and two samples must be seen at all.
  double hidden_way(double at) const {
    const double i = sample_at(at);
    const double d = static_cast<double>(expected(static_cast<float>(i)));
    const double noise = static_cast<double>(kSigmas * sigma_of(kMeasuredBehind));
    return 2 * noise * at / std::max(d, 1e-3) + kMeasuredBehind * (range(i) - range(i - 1));
  }

 private:
  static constexpr int kMeasuredBefore = 4, kMeasuredBehind = 2;  // samples, of those
  static constexpr float kSame = 2;                               // sigmas
  static constexpr float kLateral = 0.5F;                         // px [Barron2013]

  struct Drop {
    bool seen = false;
    float before = 0, behind = 0;  // mean residuals, px
    float sigma = 0;               // of their difference, px
  };
  Drop drop(const WalkPlane& plane, int i, int count) const {
    float before = 0, behind = 0;
    int n = 0, m = 0;
    // Where the ground has several slopes, the nearest alone tell how high it is.
    const int most = planes_.planes.size() > 1 ? kBehind : kBefore;
    for (int k = i - 1; k >= i - kBefore && n < most; --k) add(plane, k, before, n);
    for (int k = i; k < i + count; ++k) add(plane, k, behind, m);
    const bool seen = n >= kMeasuredBefore && m >= kMeasuredBehind;
    return {seen, before / static_cast<float>(std::max(n, 1)),
            behind / static_cast<float>(std::max(m, 1)), sigma_of(m)};
  }
  static float expected(const WalkPlane& plane, float u, float v) {
    return plane.disparity.x() * u + plane.disparity.y() * v + plane.disparity.z();
  }
  float expected(float i) const {
    const float u = line_.u0 + i * line_.du - static_cast<float>(view_.cx);
    const float v = line_.v0 + i * line_.dv - static_cast<float>(view_.cy);
    return expected(plane_, u, v);
  }
  // Of the mean of m samples (px). Neighbours along the line share their noise: three are one.
  float sigma_of(int m) const {
    const float own = static_cast<float>(view_.noise.disparity_sigma);
    const float slope = plane_.disparity.x() * line_.du + plane_.disparity.y() * line_.dv;
    const float aside = kLateral * slope;
    return std::sqrt(own * own + aside * aside / static_cast<float>(m));
  }
  bool measured(int i) const {
    float ignored = 0;
    int n = 0;
    add(plane_, i, ignored, n);
    return n > 0;
  }
  // Adds the residual of sample i (px), where it was measured.
  void add(const WalkPlane& plane, int i, float& sum, int& n) const {
    if (i < 0 || i >= line_.samples) return;
    const float fi = static_cast<float>(i);
    const int u = static_cast<int>(line_.u0 + fi * line_.du + 0.5F);
    const int v = static_cast<int>(line_.v0 + fi * line_.dv + 0.5F);
    const float d = view_.image->row(v)[u];
    if (!(d > 0)) return;
    const float fu = static_cast<float>(u) - static_cast<float>(view_.cx);
    const float fv = static_cast<float>(v) - static_cast<float>(view_.cy);
    sum += d - expected(plane, fu, fv);
    ++n;
  }

  const ScanView& view_;
  const WalkLine& line_;
  const WalkPlanes& planes_;
  const WalkPlane& plane_;
  double outward0_ = 0, outward_step_ = 0;
};

}  // namespace lamina
