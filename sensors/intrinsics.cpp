// Checks of focal lengths and principal points.
#include <lamina/sensors/intrinsics.hpp>

#include <cmath>
#include <cstdio>

namespace lamina {
namespace {

std::string numbers(const CameraModel& c) {
  char text[160];
  std::snprintf(text, sizeof text, "fx %.6g, fy %.6g, cx %.6g, cy %.6g for %d x %d pixels", c.fx,
                c.fy, c.cx, c.cy, c.width, c.height);
  return text;
}

// Of an image's width: fields of view of 170 and 1.1 degrees.
bool focal_length_possible(double focal, int pixels) {
  constexpr double kLeast = 0.044, kMost = 50;
  return focal >= kLeast * pixels && focal <= kMost * pixels;
}

bool on_edge(double principal, int pixels) { return principal <= 1 || principal >= pixels - 1.5; }

}  // namespace

std::string senseless_intrinsics(const CameraModel& c) {
  constexpr double kMostStretch = 3;
  const bool possible = focal_length_possible(c.fx, c.width) &&
                        focal_length_possible(c.fy, c.height) && c.fx < kMostStretch * c.fy &&
                        c.fy < kMostStretch * c.fx &&
                        std::abs(c.cx - 0.5 * c.width) < c.width * 2 &&
                        std::abs(c.cy - 0.5 * c.height) < c.height * 2;
  return possible ? "" : numbers(c);  // comparisons with NaN are false
}

bool scale_intrinsics(CameraModel& c, int stated_width, int stated_height) {
  constexpr double kAlike = 0.02;
  const double x = static_cast<double>(c.width) / stated_width;
  const double y = static_cast<double>(c.height) / stated_height;
  if (!(std::abs(x / y - 1) < kAlike)) return false;
  c.fx *= x;
  c.fy *= y;
  c.cx = (c.cx + 0.5) * x - 0.5;  // pixel centres are whole numbers
  c.cy = (c.cy + 0.5) * y - 0.5;
  return true;
}

DepthNoise noise_at_focal(DepthNoise noise, double factor) {
  noise.focal_baseline *= factor;
  if (noise.kind == DepthNoise::Kind::kStereo) return noise;  // the others' is stated of depth
  noise.disparity_sigma *= factor;
  noise.disparity_step *= factor;
  noise.disparity_floor *= factor;
  return noise;
}

std::optional<Warning> mend_principal_point(CameraModel& c, const std::string& where) {
  const bool x = on_edge(c.cx, c.width), y = on_edge(c.cy, c.height);
  if (!x && !y) return std::nullopt;
  const std::string stated = numbers(c);
  const auto twice = [](double principal, int pixels) {
    return std::abs(principal - pixels) < 0.1 * pixels;
  };
  if (twice(c.cx, c.width) && twice(c.cy, c.height)) {
    c.fx /= 2;
    c.fy /= 2;
    c.cx = (c.cx + 0.5) / 2 - 0.5;
    c.cy = (c.cy + 0.5) / 2 - 0.5;
    return Warning{"image_size", where + ": found " + stated +
                                     ", which are those of images twice as large; halved"};
  }
  if (x) c.cx = 0.5 * (c.width - 1);
  if (y) c.cy = 0.5 * (c.height - 1);
  return Warning{"principal_point", where + ": found " + stated +
                                        ", a principal point on the image's edge or beyond; the "
                                        "middle of the image is used"};
}

}  // namespace lamina
