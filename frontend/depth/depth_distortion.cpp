// The error of disparity over the image, from coefficients to pixels.
#include <lamina/frontend/depth/depth_distortion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

using Values = std::array<double, DepthDistortion::kMaxDegree + 1>;

// Legendre polynomials at x by their recursion.
Values legendre(double x) {
  Values p;
  p[0] = 1;
  p[1] = x;
  for (std::size_t n = 1; n + 1 < p.size(); ++n) {
    const auto k = static_cast<double>(n);
    p[n + 1] = ((2 * k + 1) * x * p[n] - k * p[n - 1]) / (k + 1);
  }
  return p;
}

// f(term, i, j) for all products of one degree after the other.
template <class F>
void for_each_term(int degree, F f) {
  int term = 0;
  for (int sum = 0; sum <= degree; ++sum) {
    for (int i = sum; i >= 0; --i) {
      f(term++, static_cast<std::size_t>(i), static_cast<std::size_t>(sum - i));
    }
  }
}

// -1 to 1 over `size` pixels.
double along(int pixel, int size) { return (2 * pixel + 1.0) / size - 1; }

}  // namespace

Eigen::VectorXd DepthDistortion::basis(double x, double y, int degree) {
  const Values px = legendre(x), py = legendre(y);
  Eigen::VectorXd values(terms(degree));
  for_each_term(degree,
                [&](int term, std::size_t i, std::size_t j) { values(term) = px[i] * py[j]; });
  return values;
}

DepthDistortion::DepthDistortion(int width, int height, const Eigen::VectorXd& coefficients)
    : width_(width), height_(height) {
  int degree = 1;
  while (degree < kMaxDegree && terms(degree) != coefficients.size()) ++degree;
  if (terms(degree) != coefficients.size() || width <= 0 || height <= 0) {
    throw Error("depth distortion: found " + std::to_string(coefficients.size()) +
                " coefficients for " + std::to_string(width) + " x " + std::to_string(height) +
                " pixels, expected those of a degree from 1 to " + std::to_string(kMaxDegree) +
                " and an image");
  }
  field_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<Values> columns;
  for (int u = 0; u < width; ++u) columns.push_back(legendre(along(u, width)));
  for (int v = 0; v < height; ++v) {
    // The polynomial in x of this row.
    const Values py = legendre(along(v, height));
    Values row{};
    for_each_term(degree, [&](int term, std::size_t i, std::size_t j) {
      row[i] += coefficients(term) * py[j];
    });
    for (const Values& px : columns) {
      double sum = 0;
      for (std::size_t i = 0; i < row.size(); ++i) sum += row[i] * px[i];
      field_.push_back(static_cast<float>(sum));
    }
  }
}

void DepthDistortion::hold_within(double low, double high) {
  const auto a = static_cast<float>(low), b = static_cast<float>(high);
  for (float& e : field_) e = std::clamp(e, a, b);
}

void DepthDistortion::add(const DepthCameraError& error, const DepthFrame& like) {
  const double fb = like.camera.noise.focal_baseline;
  if (!std::isfinite(fb) || !(fb > 0)) return;
  if (field_.empty()) {
    width_ = like.width();
    height_ = like.height();
    field_.assign(like.raw.size(), 0);
  }
  if (like.width() != width_ || like.height() != height_) return;
  focal_ *= 1 + error.focal;
  const CameraModel& c = like.camera.camera;
  std::size_t i = 0;
  for (int v = 0; v < height_; ++v) {
    for (int u = 0; u < width_; ++u) {
      const Eigen::Vector3d ray((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      field_[i++] += static_cast<float>(fb * error.e.dot(ray));
    }
  }
}

void DepthDistortion::correct(DepthFrame& frame) const {
  const double scale = frame.camera.noise.focal_baseline * frame.camera.depth_scale;
  if (frame.width() != width_ || frame.height() != height_ || frame.raw.size() != field_.size() ||
      !std::isfinite(scale) || !(scale > 0)) {
    return;
  }
  frame.camera.camera.fx /= focal_;
  frame.camera.camera.fy /= focal_;
  constexpr float kSaturated = 65535.0F;
  const auto fb = static_cast<float>(scale);
  for (std::size_t i = 0; i < field_.size(); ++i) {
    const float raw = static_cast<float>(frame.raw[i]);
    // raw' = fb / (fb / raw - e); where the error is as large as the disparity nothing is known.
    const float rest = fb - field_[i] * raw;
    const float corrected = rest > 0 ? fb * raw / rest + 0.5F : 0.0F;  // rounded as it is stored
    if (raw > 0 && raw < kSaturated)
      frame.raw[i] = corrected < kSaturated ? static_cast<std::uint16_t>(corrected) : 0;
  }
}

double DepthDistortion::rms() const {
  if (field_.empty()) return 0;
  double sum = 0;
  for (const float e : field_) sum += static_cast<double>(e) * static_cast<double>(e);
  return std::sqrt(sum / static_cast<double>(field_.size()));
}

double DepthDistortion::largest() const {
  float most = 0;
  for (const float e : field_) most = std::max(most, std::abs(e));
  return static_cast<double>(most);
}

}  // namespace lamina
