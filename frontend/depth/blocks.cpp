// The pixel pass. Full blocks go four pixels at a time; broken ones one by one.
#include <lamina/frontend/depth/blocks.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include <lamina/models/lanes.hpp>
#include <lamina/sensors/usable_camera.hpp>

namespace lamina {

using namespace lanes;

namespace {

// Own plane of centred sums; `cud`, `cvd`, `cdd` about the means.
void solve(Block& block, float cud, float cvd, float cdd) {
  const float det = block.cuu * block.cvv - block.cuv * block.cuv;
  if (block.n < 3 || !(det > 1e-3F * block.cuu * block.cvv) || !(det > 0)) {
    block.a = block.b = 0;
    block.sse = cdd;
    return;
  }
  block.a = (cud * block.cvv - cvd * block.cuv) / det;
  block.b = (cvd * block.cuu - cud * block.cuv) / det;
  block.sse = std::max(0.0F, cdd - block.a * cud - block.b * cvd);
}

// All 64 pixels valid: position sums are constants. False (and nothing done) when they are not.
bool full_block8(const float* origin, std::ptrdiff_t stride, float center_u, float center_v,
                 Block& block) {
  const float shift = origin[3 * stride + 3];
  if (!(shift > 0)) return false;
  Float4 sum[2] = {{}, {}}, square{}, down[2] = {{}, {}}, least = all(shift);
  for (int r = 0; r < 8; ++r) {
    const float y = static_cast<float>(r) - 3.5F;
    for (int half = 0; half < 2; ++half) {
      const Float4 d = load4(origin + r * stride + 4 * half);
      least = d < least ? d : least;
      const Float4 e = d - shift;
      sum[half] += e;
      square += e * e;
      down[half] += e * y;
    }
  }
  if (any4(least <= 0.0F)) return false;
  const float s = sum4(sum[0] + sum[1]);
  const float cud = sum4(sum[0] * kLeft + sum[1] * kRight);
  const float cvd = sum4(down[0] + down[1]);
  constexpr float kSpread = 64 * 5.25F;  // sum of (i - 3.5)^2 over the block
  block.n = 64;
  block.u = center_u;
  block.v = center_v;
  block.d = shift + s / 64;
  block.cuu = block.cvv = kSpread;
  block.cuv = 0;
  block.a = cud / kSpread;
  block.b = cvd / kSpread;
  block.sse = std::max(0.0F, sum4(square) - s * s / 64 - block.a * cud - block.b * cvd);
  return true;
}

// Sums about (u, v), with disparities less `shift`, to a block.
void set_block(const BlockSums& s, float u, float v, float shift, Block& block) {
  block = Block();
  const float n = s.count();
  block.n = n;
  if (n == 0) return;
  const float x = s.sum_x(), y = s.sum_y(), e = s.sum_e();
  block.u = u + x / n;
  block.v = v + y / n;
  block.d = shift + e / n;
  block.cuu = s.sum_xx() - x * x / n;
  block.cuv = s.sum_xy() - x * y / n;
  block.cvv = s.sum_yy() - y * y / n;
  solve(block, s.sum_xe() - x * e / n, s.sum_ye() - y * e / n, s.sum_ee() - e * e / n);
}

// Some of the 64 pixels valid.
void broken_block8(const float* origin, std::ptrdiff_t stride, float center_u, float center_v,
                   Block& block) {
  float shift = 0;  // the largest of the first row that has any
  for (int r = 0; r < 8 && !(shift > 0); ++r) {
    const Float4 a = load4(origin + r * stride), b = load4(origin + r * stride + 4);
    const Float4 most = a > b ? a : b;
    shift = std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
  }
  if (!(shift > 0)) {
    block = Block();
    return;
  }
  BlockSums sums;
  for (int half = 0; half < 2; ++half) {
    HalfSums s;
    for (int r = 0; r < 8; ++r) {
      const Float4 d = load4(origin + r * stride + 4 * half);
      s.add(d > 0.0F, d - shift, all(static_cast<float>(r) - 3.5F));
    }
    sums.half[half] = s;
  }
  set_block(sums, center_u, center_v, shift, block);
}

struct Window {
  int u0, v0, u1, v1;
};

// Any subset of a window's pixels.
template <class Keep>
void partial_block(const DisparityImage& image, const DisparityGeometry& g, const Window& w,
                   const Keep& keep, Block& block) {
  const float shift_u = 0.5F * static_cast<float>(w.u0 + w.u1 - 1);
  const float shift_v = 0.5F * static_cast<float>(w.v0 + w.v1 - 1);
  float n = 0, su = 0, sv = 0, sd = 0, suu = 0, suv = 0, svv = 0, sud = 0, svd = 0, sdd = 0;
  float shift_d = 0;
  for (int v = w.v0; v < w.v1; ++v) {
    const float* row = image.row(v);
    for (int u = w.u0; u < w.u1; ++u) {
      if (!(row[u] > 0) || !keep(u, v)) continue;
      if (n == 0) shift_d = row[u];
      const float x = static_cast<float>(u) - shift_u, y = static_cast<float>(v) - shift_v;
      const float e = row[u] - shift_d;
      n += 1;
      su += x;
      sv += y;
      sd += e;
      suu += x * x;
      suv += x * y;
      svv += y * y;
      sud += x * e;
      svd += y * e;
      sdd += e * e;
    }
  }
  block = Block();
  block.n = n;
  if (n == 0) return;
  block.u = shift_u + su / n - static_cast<float>(g.cx);
  block.v = shift_v + sv / n - static_cast<float>(g.cy);
  block.d = shift_d + sd / n;
  block.cuu = suu - su * su / n;
  block.cuv = suv - su * sv / n;
  block.cvv = svv - sv * sv / n;
  solve(block, sud - su * sd / n, svd - sv * sd / n, sdd - sd * sd / n);
}

Window window_of(const DisparityImage& image, int size, int c, int r) {
  return {c * size, r * size, std::min(image.width, (c + 1) * size),
          std::min(image.height, (r + 1) * size)};
}

}  // namespace

void fill_disparity(const DepthFrame& frame, DisparityImage& image) {
  const int width = std::max(0, frame.width()), height = std::max(0, frame.height());
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  image.width = width;
  image.height = height;
  image.d.resize(size);
  const DepthCamera& camera = frame.camera;
  const double scale = camera.noise.focal_baseline * camera.depth_scale;
  const bool usable = frame.raw.size() >= size && std::isfinite(scale) && scale > 0 &&
                      camera.depth_scale > 0 && lamina::usable(camera.camera);
  if (!usable) {
    std::fill(image.d.begin(), image.d.end(), 0.0F);
    return;
  }
  const double lowest = std::max(1.0, std::ceil(camera.noise.min_range * camera.depth_scale));
  const double highest =
      std::clamp(std::floor(camera.noise.max_range * camera.depth_scale), 0.0, 65534.0);
  const float low = static_cast<float>(lowest), high = static_cast<float>(highest);
  const float fb = static_cast<float>(scale);
  const std::uint16_t* raw = frame.raw.data();
  float* out = image.d.data();
  std::size_t i = 0;
  for (; i + 4 <= size; i += 4) {
    const Float4 z = load4_as_float(raw + i);
    const Int4 good = (z >= low) & (z <= high);
    store4(out + i, only(good, fb / z));
  }
  for (; i < size; ++i) {
    const float z = static_cast<float>(static_cast<int>(raw[i]));
    out[i] = z >= low && z <= high ? fb / z : 0.0F;
  }
}

void fill_blocks(const DisparityImage& image, const DisparityGeometry& g, int size,
                 BlockImage& blocks) {
  blocks.size = size;
  blocks.columns = (image.width + size - 1) / size;
  blocks.rows = (image.height + size - 1) / size;
  blocks.blocks.resize(static_cast<std::size_t>(blocks.columns) *
                       static_cast<std::size_t>(blocks.rows));
  const auto all = [](int, int) { return true; };
  std::size_t i = 0;
  for (int r = 0; r < blocks.rows; ++r) {
    for (int c = 0; c < blocks.columns; ++c, ++i) {
      const Window w = window_of(image, size, c, r);
      Block& block = blocks.blocks[i];
      block.flat = false;
      const float center_u = static_cast<float>(w.u0 + 3.5 - g.cx);
      const float center_v = static_cast<float>(w.v0 + 3.5 - g.cy);
      const bool whole = size == 8 && w.u1 - w.u0 == 8 && w.v1 - w.v0 == 8;
      if (!whole) {
        partial_block(image, g, w, all, block);
        continue;
      }
      const float* origin = image.row(w.v0) + w.u0;
      if (full_block8(origin, image.width, center_u, center_v, block)) continue;
      broken_block8(origin, image.width, center_u, center_v, block);
    }
  }
}

namespace {

// The value std::nth_element finds. Values are counted by the top bits of their order-preserving
// integers first, so that only a small share of them has to be ordered.
float nth_smallest(std::vector<float>& values, std::size_t n) {
  constexpr std::uint32_t kSign = 0x80000000U;
  constexpr int kShift = 21;
  const auto bin_of = [](float x) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
    return ((bits & kSign) != 0 ? ~bits : bits | kSign) >> kShift;
  };
  std::array<std::uint32_t, (std::size_t{1} << (32 - kShift))> count{};
  for (const float x : values) ++count[bin_of(x)];
  std::uint32_t bin = 0;
  for (; n >= count[bin]; ++bin) n -= count[bin];
  std::size_t kept = 0;
  for (const float x : values) {
    values[kept] = x;
    kept += bin_of(x) == bin;
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(n);
  std::nth_element(values.begin(), at, values.begin() + static_cast<std::ptrdiff_t>(kept));
  return *at;
}

}  // namespace

double noise_scale(const BlockImage& blocks, double disparity_sigma, double most) {
  if (!(disparity_sigma > 0)) return 1.0;
  std::vector<float> variances, of_holed, of_even;
  variances.reserve(blocks.blocks.size());
  const float pixels = static_cast<float>(blocks.size * blocks.size);
  const float model = static_cast<float>(disparity_sigma * disparity_sigma);
  for (const Block& block : blocks.blocks) {
    if (block.n < 0.5F * pixels || block.n <= 3) continue;
    const float possible = jitter_variance(block.a, block.b);
    const float jitter = std::min(6 * model, possible);
    const float variance = (block.sse / (block.n - 3) - jitter) / model;
    (block.n < 0.9F * pixels ? of_holed : variances).push_back(variance);
    if (block.n >= 0.9F * pixels && possible < model) of_even.push_back(variance);
  }
  // What a slope's jitter may make hides the noise, on a floor near a coarse camera all of it:
  // where there are blocks without it, as on walls, they alone tell. Blocks with holes lie at edges
  // in most images. Where nearly all have holes, pixels are missing everywhere, and these blocks
  // are as good as others.
  if (10 * variances.size() < of_holed.size()) {
    variances.insert(variances.end(), of_holed.begin(), of_holed.end());
  } else if (of_even.size() >= 20 && 20 * of_even.size() > variances.size()) {
    variances = std::move(of_even);
  }
  if (variances.size() < 20) return 1.0;
  const float quarter = nth_smallest(variances, variances.size() / 4);
  return std::sqrt(std::clamp(static_cast<double>(quarter), 1.0, most * most));
}

double shared_variance(const BlockImage& blocks, double variance_of_mean, double model) {
  // Slow distortion goes with the angle: places as far apart in a small image would lie on
  // different planes.
  const double scale = blocks.columns * blocks.size / 640.0;
  const int step = std::max(2, static_cast<int>(std::lround(scale * 48 / blocks.size)));
  const double largest = std::pow(0.15 * std::min(scale, 1.0), 2);
  std::vector<float> differences(2 * blocks.blocks.size());
  std::size_t count = 0;
  const auto take = [&](const Block& a, const Block& b, const Block& c) {
    if (b.flat && c.flat) differences[count++] = std::abs(a.d - 2 * b.d + c.d);
  };
  for (int r = 0; r < blocks.rows; ++r) {
    for (int c = 0; c < blocks.columns; ++c) {
      if (!blocks.at(c, r).flat) continue;
      if (c + 2 * step < blocks.columns) {
        take(blocks.at(c, r), blocks.at(c + step, r), blocks.at(c + 2 * step, r));
      }
      if (r + 2 * step < blocks.rows) {
        take(blocks.at(c, r), blocks.at(c, r + step), blocks.at(c, r + 2 * step));
      }
    }
  }
  differences.resize(count);
  if (count < 100) return model;
  // The 30 % quantile of |x| of a normal variable is 0.385 sigma; edges sit in the upper part.
  const float quantile = nth_smallest(
      differences, static_cast<std::size_t>(0.3 * static_cast<double>(differences.size())));
  const double sigma = static_cast<double>(quantile) / 0.385;
  return std::clamp(sigma * sigma / 6 - variance_of_mean, model, std::max(model, largest));
}

bool is_outlier(const DisparityImage& image, int u, int v, float tolerance) {
  const float* row = image.row(v);
  const float d = row[u];
  if (u > 0 && u + 1 < image.width) {
    const float l = row[u - 1], r = row[u + 1];
    if (l > 0 && r > 0 && std::abs(d - 0.5F * (l + r)) <= tolerance) return false;
  }
  if (v > 0 && v + 1 < image.height) {
    const float t = row[u - image.width], b = row[u + image.width];
    if (t > 0 && b > 0 && std::abs(d - 0.5F * (t + b)) <= tolerance) return false;
  }
  return true;
}

namespace {

// is_outlier() for a window's pixels, row by row: 0 for outliers and for what was not
// measured. Away from the image's border eight
// pixels at once.
void find_kept(const DisparityImage& image, const Window& w, float tolerance, std::uint8_t* kept) {
  const bool inside =
      w.u0 > 0 && w.v0 > 0 && w.u1 < image.width && w.v1 < image.height && (w.u1 - w.u0) % 8 == 0;
  for (int v = w.v0; v < w.v1; ++v) {
    if (!inside) {
      for (int u = w.u0; u < w.u1; ++u) {
        *kept++ = image.row(v)[u] > 0 && !is_outlier(image, u, v, tolerance);
      }
      continue;
    }
    const float* at = image.row(v) + w.u0;
    const auto good = [&](const float* p) {
      const Float4 d = load4(p);
      const auto agrees = [&](const Float4& a, const Float4& b) {
        const Float4 off = d - 0.5F * (a + b);
        return (a > 0.0F) & (b > 0.0F) & (off <= tolerance) & (off >= -tolerance);
      };
      return (agrees(load4(p - 1), load4(p + 1)) |
              agrees(load4(p - image.width), load4(p + image.width))) &
             (d > 0.0F);
    };
    for (int u = w.u0; u < w.u1; u += 8, at += 8, kept += 8) {
      const Byte8 bits = narrow8(good(at), good(at + 4)) & 1;
      std::memcpy(kept, &bits, sizeof(bits));
    }
  }
}

// Whether a block of 8 x 8 is uneven beyond doubt without its outliers: fewer than `min_pixels`, or
// half as much again off its own plane as `most` (px^2) a pixel. Its sums are rounded otherwise
// than those of partial_block, by less than a hundredth.
bool stays_uneven(const DisparityImage& image, const Window& w, const std::uint8_t* kept,
                  float shift, float min_pixels, float most) {
  const BlockSums sums =
      marked_sums8(image.row(w.v0) + w.u0, image.width, kept, 8, 8, shift, std::uint8_t{1});
  Block block;
  set_block(sums, 0, 0, shift, block);
  if (block.n < min_pixels || block.n <= 3) return true;
  const bool has_slopes = block.a != 0 || block.b != 0;
  return has_slopes && block.sse > 1.5F * most * (block.n - 3) + 0.01F * sums.sum_ee();
}

}  // namespace

void remove_outliers(const DisparityImage& image, const DisparityGeometry& g, float tolerance,
                     float sigma, float min_pixels, BlockImage& blocks) {
  constexpr float kLoose = 1.8F * 1.8F;
  const float limit = kLoose * sigma * sigma;
  const auto is_flat = [&](const Block& b) {
    // A step between two surfaces looks steep too: more than slopes of floors is not allowed for.
    const float jitter = std::min(6 * sigma * sigma, jitter_variance(b.a, b.b));
    return b.n >= min_pixels && b.n > 3 && b.sse <= (limit + kLoose * jitter) * (b.n - 3);
  };
  std::vector<std::uint8_t> kept(static_cast<std::size_t>(blocks.size * blocks.size));
  std::size_t i = 0;
  for (int r = 0; r < blocks.rows; ++r) {
    for (int c = 0; c < blocks.columns; ++c, ++i) {
      Block& block = blocks.blocks[i];
      block.flat = is_flat(block);
      // A stray pixel j px off leaves j^2 / 64; far more than that is two surfaces and cannot heal.
      if (block.flat || block.n < min_pixels || block.sse > 400 * limit * block.n) continue;
      Block cleaned;
      const Window w = window_of(image, blocks.size, c, r);
      find_kept(image, w, tolerance, kept.data());
      const bool whole = blocks.size == 8 && w.u1 - w.u0 == 8 && w.v1 - w.v0 == 8;
      if (whole && stays_uneven(image, w, kept.data(), block.d, min_pixels, 7 * limit)) continue;
      const auto keep = [&](int u, int v) {
        return kept[static_cast<std::size_t>((v - w.v0) * (w.u1 - w.u0) + u - w.u0)] != 0;
      };
      partial_block(image, g, w, keep, cleaned);
      cleaned.flat = is_flat(cleaned);
      if (cleaned.flat) block = cleaned;
    }
  }
}

}  // namespace lamina
