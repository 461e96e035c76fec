// The pixels of one way outward, worked out ahead of the walk: gathers wait for memory, walks not.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>

#include <lamina/frontend/obstacles/scan_view.hpp>
#include <lamina/models/lanes.hpp>

namespace lamina {

/// A line's pixels against a floor, a stretch at a time; four samples together, each as if alone.
class LineSamples {
 public:
  /// A floor's disparity, d = x (u - cx) + y (v - cy) + z, its distance from the optical centre
  /// (m), and what it may be off: px of disparity or metres of height, whichever is more.
  struct Floor {
    Eigen::Vector3f disparity = Eigen::Vector3f::Zero();
    float camera_height = 1, noise_px = 0, step = 0;
  };

  LineSamples(const ScanView& view, const WalkLine& line) : view_(view), line_(line) {}

  /// Against another floor from now on.
  void follow(const Floor& floor) {
    floor_ = floor;
    end_ = 0;
    const Eigen::Vector3d p = floor.disparity.cast<double>();
    const double u = static_cast<double>(line_.u0), v = static_cast<double>(line_.v0);
    const double du = static_cast<double>(line_.du), dv = static_cast<double>(line_.dv);
    disparity0_ = p.dot(Eigen::Vector3d(u - view_.cx, v - view_.cy, 1));
    disparity_step_ = p.x() * du + p.y() * dv;
    outward0_ = view_.ray(u, v).head<2>().dot(line_.direction);
    outward_step_ = view_.ray(u + du, v + dv).head<2>().dot(line_.direction) - outward0_;
  }
  /// Horizontal distance (m) from the camera's foot at which sample i's ray meets the floor: along
  /// a line its disparity and the ray's outward part both change linearly.
  double range_on_floor(double i) const {
    const double d = disparity0_ + i * disparity_step_;
    const double outward = std::max(0.0, outward0_ + i * outward_step_);
    return d > 1e-9 ? view_.noise.focal_baseline / d * outward : 1e9;
  }
  /// The pixel of sample i.
  std::size_t pixel(int i) const {
    const int u = static_cast<int>(line_.u0 + static_cast<float>(i) * line_.du + 0.5F);
    const int v = static_cast<int>(line_.v0 + static_cast<float>(i) * line_.dv + 0.5F);
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(view_.image->width) +
           static_cast<std::size_t>(u);
  }

  /// Makes samples i to i + count - 1 (4 at most, within the line) available.
  void need(int i, int count) {
    if (i < from_ || i + count > end_) fetch(i);
  }
  const float* height(int i) const { return height_.data() + (i - from_); }  ///< m above the floor
  /// Squared, m^2: what it may be off; 0: the pixel is missing.
  const float* tolerance2(int i) const { return tolerance2_.data() + (i - from_); }
  const float* range(int i) const { return range_.data() + (i - from_); }  ///< range_on_floor (m)

 private:
  static constexpr int kStretch = 32;
  static constexpr float kLeast = 1e-9F;  // disparity in 1/m, for what lies at the horizon

  void fetch(int i);

  const ScanView& view_;
  const WalkLine& line_;
  Floor floor_;
  double disparity0_ = 0, disparity_step_ = 0, outward0_ = 0, outward_step_ = 0;
  int from_ = 0, end_ = 0;
  alignas(16) std::array<float, kStretch + 4> height_, tolerance2_, range_;
};

inline void LineSamples::fetch(int i) {
  using namespace lanes;
  constexpr Float4 kSteps = {0, 1, 2, 3}, kZero = {};
  from_ = i;
  const int end = end_ = std::min(i + kStretch, line_.samples);
  // All that is constant in registers: stores of floats do not touch it.
  const float* image = view_.image->d.data();
  const Int4 width = view_.image->width + Int4{};
  const Float4 u0 = line_.u0 + 0.5F + kZero, v0 = line_.v0 + 0.5F + kZero;
  const Float4 du = line_.du + kZero, dv = line_.dv + kZero;
  const Eigen::Vector3f& p = floor_.disparity;
  const Float4 px = p.x() + kZero, py = p.y() + kZero;
  const Float4 pz =
      p.z() - p.x() * static_cast<float>(view_.cx) - p.y() * static_cast<float>(view_.cy) + kZero;
  const Float4 camera_height = floor_.camera_height + kZero, step = floor_.step + kZero;
  const Float4 noise_m = floor_.noise_px * floor_.camera_height + kZero;
  const Float4 expected0 = static_cast<float>(disparity0_ / view_.noise.focal_baseline) + kZero;
  const Float4 expected_step =
      static_cast<float>(disparity_step_ / view_.noise.focal_baseline) + kZero;
  const Float4 outward0 = static_cast<float>(outward0_) + kZero;
  const Float4 outward_step = static_cast<float>(outward_step_) + kZero;
  float *height = height_.data(), *tolerance = tolerance2_.data(), *range = range_.data();
  // The last few look at the line's last pixel again: nobody asks for them.
  const Float4 last = static_cast<float>(end - 1) + kZero;
  Float4 next = static_cast<float>(i) + kSteps;
  for (; i < end; i += 4, next += 4, height += 4, tolerance += 4, range += 4) {
    const Float4 at = next < last ? next : last;
    const Int4 pu = __builtin_convertvector(u0 + at * du, Int4);
    const Int4 pv = __builtin_convertvector(v0 + at * dv, Int4);
    const Int4 pixel = pv * width + pu;
    std::uint64_t two[2];
    std::memcpy(two, &pixel, sizeof(two));
    const Float4 d = {image[static_cast<std::uint32_t>(two[0])], image[two[0] >> 32],
                      image[static_cast<std::uint32_t>(two[1])], image[two[1] >> 32]};
    const Float4 off = d - (px * __builtin_convertvector(pu, Float4) +
                            py * __builtin_convertvector(pv, Float4) + pz);
    // Above the plane by height: off = height d / camera_height.
    const Float4 per_d = 1 / d;
    const Float4 noise = noise_m * per_d;
    const Float4 most = noise > step ? noise : step;
    store4(height, off * camera_height * per_d);
    store4(tolerance, only(d > 0.0F, most * most));
    const Float4 expected = expected0 + at * expected_step;
    store4(range, (outward0 + at * outward_step) / (expected > kLeast ? expected : kLeast + kZero));
  }
}

}  // namespace lamina
