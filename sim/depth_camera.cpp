// What a depth sensor makes of the exact image: noise, shadow, drop-out, quantisation.
#include <lamina/sim/depth_camera.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina::sim {
namespace {

enum Stream : std::uint64_t { kDistortion = 1, kNoise = 1000, kLateral, kGrazing, kDropout };
constexpr double kPi = 3.14159265358979323846;

/// Streams of one frame; far apart, so that no two frames share numbers.
std::uint64_t stream_of(Stream kind, std::uint64_t frame_index) {
  return static_cast<std::uint64_t>(kind) + 16 * frame_index;
}

/// Rounds half up; an addition and a conversion, where std::lround is a call (sim_bench: 2 ms a
/// frame). For |x| < 4096.
int nearest_integer(float x) { return static_cast<int>(x + 4096.5F) - 4096; }

void smooth_rows(const std::vector<float>& kernel, std::size_t w, std::size_t h,
                 std::vector<float>& image) {
  const std::size_t r = kernel.size() - 1;
  std::vector<float> padded(w + 2 * r);
  for (std::size_t v = 0; v < h; ++v) {
    float* row = &image[v * w];
    std::copy(row, row + w, padded.begin() + static_cast<std::ptrdiff_t>(r));
    for (std::size_t k = 1; k <= r; ++k) {
      padded[r - k] = row[std::min(w - 1, k)];
      padded[r + w - 1 + k] = row[w - 1 - std::min(w - 1, k)];
    }
    for (std::size_t u = 0; u < w; ++u) {
      row[u] = kernel[0] * padded[u + r];
    }
    for (std::size_t k = 1; k <= r; ++k) {
      const float *a = &padded[r - k], *b = &padded[r + k];
      const float weight = kernel[k];
      for (std::size_t u = 0; u < w; ++u) {
        row[u] += weight * (a[u] + b[u]);
      }
    }
  }
}

void smooth_columns(const std::vector<float>& kernel, std::size_t w, std::size_t h,
                    std::vector<float>& image) {
  std::vector<float> out(image.size());
  for (std::size_t v = 0; v < h; ++v) {
    float* to = &out[v * w];
    const float* middle = &image[v * w];
    for (std::size_t u = 0; u < w; ++u) {
      to[u] = kernel[0] * middle[u];
    }
    for (std::size_t k = 1; k < kernel.size(); ++k) {
      const std::size_t up = v >= k ? v - k : std::min(h - 1, k - v);
      const std::size_t down = v + k < h ? v + k : 2 * (h - 1) - std::min(v + k, 2 * (h - 1));
      const float *a = &image[up * w], *b = &image[down * w];
      const float weight = kernel[k];
      for (std::size_t u = 0; u < w; ++u) {
        to[u] += weight * (a[u] + b[u]);
      }
    }
  }
  image.swap(out);
}

/// Smooths rows, then columns, in place; borders are mirrored.
void smooth(const std::vector<float>& kernel, int width, int height, std::vector<float>& image) {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  smooth_rows(kernel, w, h, image);
  smooth_columns(kernel, w, h, image);
}

/// A smooth field of unit variance: waves of up to 2.5 periods over the image, fixed by the seed.
std::vector<float> slow_field(int width, int height, std::uint64_t seed) {
  constexpr int kWaves = 8;
  Random random(seed, kDistortion);
  std::vector<float> field(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<double> row(2 * static_cast<std::size_t>(width));
  for (int k = 0; k < kWaves; ++k) {
    const double fu = random.uniform(-2.5, 2.5) / width, fv = random.uniform(-2.5, 2.5) / height;
    const double phase = random.uniform(0, 1);
    for (std::size_t u = 0; u < row.size() / 2; ++u) {
      row[2 * u] = std::sqrt(2.0 / kWaves) * std::cos(2 * kPi * fu * static_cast<double>(u));
      row[2 * u + 1] = std::sqrt(2.0 / kWaves) * std::sin(2 * kPi * fu * static_cast<double>(u));
    }
    float* out = field.data();
    for (int v = 0; v < height; ++v) {
      const double c = std::cos(2 * kPi * (fv * v + phase)),
                   s = std::sin(2 * kPi * (fv * v + phase));
      for (std::size_t u = 0; u < row.size() / 2; ++u) {
        *out++ += static_cast<float>(c * row[2 * u] - s * row[2 * u + 1]);
      }
    }
  }
  return field;
}

}  // namespace

DepthEffects DepthEffects::none() {
  DepthEffects effects;
  effects.noise = effects.correlated = effects.quantise = effects.lateral = false;
  effects.shadow = effects.grazing = effects.distortion = false;
  return effects;
}

std::vector<float> correlation_kernel(double correlation_px) {
  if (!(correlation_px > 1)) {
    return {1.0F};
  }
  // White noise smoothed by h has correlations that sum to (sum h)^2 / sum h^2 over all lags: find
  // the width of the Gaussian for which that is correlation_px.
  const int radius = static_cast<int>(std::ceil(1.2 * correlation_px)) + 1;
  std::vector<double> half(static_cast<std::size_t>(radius) + 1);
  double low = 0.05, high = correlation_px, energy = 1;
  for (int step = 0; step < 60; ++step) {
    const double s = 0.5 * (low + high);
    double sum = 0;
    energy = 0;
    for (std::size_t k = 0; k < half.size(); ++k) {
      const double x = static_cast<double>(k) / s;
      half[k] = std::exp(-0.5 * x * x);
      sum += (k == 0 ? 1 : 2) * half[k];
      energy += (k == 0 ? 1 : 2) * half[k] * half[k];
    }
    (sum * sum / energy < correlation_px ? low : high) = s;
  }
  std::vector<float> kernel;
  for (double value : half) {
    kernel.push_back(static_cast<float>(value / std::sqrt(energy)));
  }
  return kernel;
}

DepthRenderer::DepthRenderer(const Caster& caster, const DepthCamera& camera,
                             const DepthEffects& effects, std::uint64_t seed)
    : caster_(&caster), camera_(camera), effects_(effects), seed_(seed) {
  const DepthNoise& model = camera.noise;
  if (model.kind == DepthNoise::Kind::kIdeal) {
    effects_ = DepthEffects::none();
  }
  // Rounding to steps adds step^2/12 of variance; the rest of the model's is added beforehand.
  const double step = effects_.quantise ? model.disparity_step : 0;
  added_sigma_ = effects_.noise
                     ? std::sqrt(std::max(
                           0.0, model.disparity_sigma * model.disparity_sigma - step * step / 12))
                     : 0;
  kernel_ = correlation_kernel(effects_.correlated ? model.correlation_px : 0);
  const CameraModel& c = camera.camera;
  const std::size_t size = static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height);
  const double sigma =
      effects.distortion_sigma_px >= 0 ? effects.distortion_sigma_px : model.disparity_floor;
  if (effects_.distortion && sigma > 0) {
    distortion_ = slow_field(c.width, c.height, seed);
    for (float& value : distortion_) {
      value *= static_cast<float>(sigma);
    }
  } else {
    distortion_.assign(size, 0.0F);
  }
  for (std::size_t i = 0; effects_.distortion && i < size; ++i) {
    const double u = static_cast<double>(i % static_cast<std::size_t>(c.width));
    distortion_[i] += static_cast<float>(effects_.slope_px * ((u + 0.5) / c.width - 0.5));
  }
  ray_length_.resize(size);
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const double x = (u - c.cx) / c.fx, y = (v - c.cy) / c.fy;
      ray_length_[static_cast<std::size_t>(v * c.width + u)] =
          static_cast<float>(std::sqrt(x * x + y * y + 1));
    }
  }
}

void DepthRenderer::fill_noise(std::uint64_t frame_index, std::vector<float>& noise) const {
  if (!(added_sigma_ > 0)) {
    return;
  }
  normals_.fill(seed_, stream_of(kNoise, frame_index), noise);
  if (kernel_.size() > 1) {
    smooth(kernel_, camera_.camera.width, camera_.camera.height, noise);
  }
  for (float& value : noise) {
    value *= static_cast<float>(added_sigma_);
  }
}

void DepthRenderer::sample(const DepthTruth& truth, const std::vector<Linear>& linear,
                           std::uint64_t frame_index, std::vector<float>& inverse) const {
  if (!effects_.lateral || !(effects_.lateral_sigma_px > 0)) {
    return;
  }
  std::vector<float> shift(2 * inverse.size());
  normals_.fill(seed_, stream_of(kLateral, frame_index), shift);
  const float sigma = static_cast<float>(effects_.lateral_sigma_px);
  for (int v = 0; v < truth.height; ++v) {
    for (int u = 0; u < truth.width; ++u) {
      const std::size_t at = truth.index(u, v);
      const float du = sigma * shift[2 * at], dv = sigma * shift[2 * at + 1];
      // The pixel that is really looked at, and the fraction beyond it along its own plane.
      const int nu = std::clamp(u + nearest_integer(du), 0, truth.width - 1);
      const int nv = std::clamp(v + nearest_integer(dv), 0, truth.height - 1);
      const std::size_t from = truth.index(nu, nv);
      float value = truth.inverse_depth[from];
      const std::int32_t s = truth.surface[from];
      if (s >= 0 && static_cast<std::size_t>(s) < linear.size()) {
        const Linear& l = linear[static_cast<std::size_t>(s)];
        value += static_cast<float>(l.du) * (static_cast<float>(u - nu) + du) +
                 static_cast<float>(l.dv) * (static_cast<float>(v - nv) + dv);
      }
      inverse[at] = value;
    }
  }
}

void DepthRenderer::drop_grazing(const DepthTruth& truth, const std::vector<Linear>& linear,
                                 std::uint64_t frame_index, std::vector<float>& inverse) const {
  if (!effects_.grazing) {
    return;
  }
  // cos of incidence = |n.d| / |d| = |rho| / (Z |d|). Chance of loss runs from 0 to 1 over the
  // band.
  const double low = (effects_.grazing_deg - effects_.grazing_band_deg) * kPi / 180;
  const double high = (effects_.grazing_deg + effects_.grazing_band_deg) * kPi / 180;
  const float cos_low = static_cast<float>(std::cos(low));
  const float cos_high = static_cast<float>(std::cos(high));
  const std::uint64_t stream = stream_of(kGrazing, frame_index);
  for (std::size_t i = 0; i < inverse.size(); ++i) {
    const std::int32_t s = truth.surface[i];
    if (s < 0 || static_cast<std::size_t>(s) >= linear.size()) {
      continue;
    }
    const float rho = static_cast<float>(std::abs(linear[static_cast<std::size_t>(s)].rho));
    const float cosine = rho * truth.inverse_depth[i] / ray_length_[i];
    if (cosine >= cos_low) {
      continue;
    }
    const float chance = (cos_low - cosine) / std::max(1e-6F, cos_low - cos_high);
    const double draw = static_cast<double>(random_bits(seed_, stream, i) >> 40) * 0x1.0p-24;
    if (draw < static_cast<double>(chance)) {
      inverse[i] = 0;
    }
  }
}

void DepthRenderer::drop_shadow(const DepthTruth& truth, std::vector<float>& inverse) const {
  const float fb = static_cast<float>(camera_.noise.focal_baseline);
  if (!effects_.shadow || !(fb > 0)) {
    return;
  }
  // The second viewpoint sees pixel u in its column u - fb/Z. Going left along a row, what comes
  // at or right of a column already passed is hidden behind it: fb (1/Zn - 1/Zf) px left of edges.
  for (int v = 0; v < truth.height; ++v) {
    float passed = std::numeric_limits<float>::infinity();
    for (int u = truth.width - 1; u >= 0; --u) {
      const std::size_t i = truth.index(u, v);
      const float column = static_cast<float>(u) - fb * truth.inverse_depth[i];
      if (column > passed) {
        inverse[i] = 0;
      }
      passed = std::min(passed, column);
    }
  }
}

void DepthRenderer::quantise(const std::vector<float>& inverse, const std::vector<float>& noise,
                             DepthFrame& frame) const {
  const DepthNoise& model = camera_.noise;
  const bool ideal = model.kind == DepthNoise::Kind::kIdeal || !(model.focal_baseline > 0);
  const double fb = ideal ? 1 : model.focal_baseline;
  const double step = effects_.quantise ? model.disparity_step : 0;
  const double inverse_step = step > 0 ? 1 / step : 0;
  for (std::size_t i = 0; i < inverse.size(); ++i) {
    if (!(inverse[i] > 0)) {
      continue;
    }
    double disparity =
        fb * static_cast<double>(inverse[i]) + static_cast<double>(noise[i] + distortion_[i]);
    if (step > 0) {
      disparity = std::floor(disparity * inverse_step + 0.5) * step;
    }
    const double z = disparity > 0 ? fb / disparity : 0;
    if (z >= model.min_range && z <= model.max_range && z > 0) {
      const double raw = std::floor(z * camera_.depth_scale + 0.5);
      frame.raw[i] = raw <= 65535 ? static_cast<std::uint16_t>(raw) : std::uint16_t{0};
    }
  }
}

DepthFrame DepthRenderer::measure(const DepthTruth& truth, const SE3& T_map_camera, Timestamp stamp,
                                  std::uint64_t frame_index) const {
  DepthFrame frame;
  frame.stamp = stamp;
  frame.camera = camera_;
  frame.raw.assign(truth.inverse_depth.size(), 0);
  const SE3 T_camera_map = T_map_camera.inverse();
  std::vector<Linear> linear;
  for (const Face& face : caster_->scene().faces()) {
    const Plane plane_camera = T_camera_map * face.plane_map;
    linear.push_back(std::abs(plane_camera.rho()) < 1e-9 ? Linear{} : linear_of(plane_camera));
  }
  std::vector<float> inverse = truth.inverse_depth;
  std::vector<float> noise(inverse.size(), 0.0F);
  sample(truth, linear, frame_index, inverse);
  drop_grazing(truth, linear, frame_index, inverse);
  drop_shadow(truth, inverse);
  if (effects_.dropout > 0) {
    const std::uint64_t stream = stream_of(kDropout, frame_index);
    for (std::size_t i = 0; i < inverse.size(); ++i) {
      const double draw = static_cast<double>(random_bits(seed_, stream, i) >> 11) * 0x1.0p-53;
      inverse[i] = draw < effects_.dropout ? 0 : inverse[i];
    }
  }
  fill_noise(frame_index, noise);
  quantise(inverse, noise, frame);
  return frame;
}

}  // namespace lamina::sim
