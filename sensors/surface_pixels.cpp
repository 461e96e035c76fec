// Counts agreement by blocks.
#include <lamina/sensors/surface_pixels.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

/// By raw depth: how much a neighbour's may differ.
class Agreement {
 public:
  Agreement(const DepthFrame& frame, const SurfacePixelsOptions& options)
      : camera_(frame.camera), options_(options) {}
  bool operator()(std::uint16_t a, std::uint16_t b) const {
    if (a == 0 || b == 0) return false;
    const int off = std::abs(int{a} - int{b});
    if (off <= 1) return true;  // no depth is finer than its unit
    const double z = std::min(a, b) / camera_.depth_scale;
    const double noise = options_.sigmas * std::sqrt(2.0) * camera_.noise.sigma_depth(z);
    return off <= std::max(noise, options_.near * z) * camera_.depth_scale;
  }

 private:
  const DepthCamera& camera_;
  const SurfacePixelsOptions& options_;
};

struct Block {
  int pixels = 0, disagreeing = 0;
};

/// With neighbours, and like none of them.
bool disagrees(const DepthFrame& frame, const Agreement& agree, int u, int v) {
  const std::uint16_t raw = frame.raw_at(u, v);
  bool any = false;
  const auto like = [&](int u2, int v2) {
    if (u2 < 0 || v2 < 0 || u2 >= frame.width() || v2 >= frame.height()) return false;
    const std::uint16_t other = frame.raw_at(u2, v2);
    any = any || other != 0;
    return agree(raw, other);
  };
  return !(like(u + 1, v) || like(u, v + 1) || like(u - 1, v) || like(u, v - 1)) && any;
}

/// By a quarter of its pixels.
Block judged(const DepthFrame& frame, const Agreement& agree, int u0, int u1, int v0, int v1) {
  Block block;
  for (int v = v0; v < v1; v += 2) {
    for (int u = u0; u < u1; u += 2) {
      if (frame.raw_at(u, v) == 0) continue;
      ++block.pixels;
      block.disagreeing += disagrees(frame, agree, u, v);
    }
  }
  return block;
}

}  // namespace

PixelsLeftOut leave_surfaces(DepthFrame& frame, const SurfacePixelsOptions& options) {
  PixelsLeftOut out;
  const Agreement agree(frame, options);
  std::vector<std::uint16_t> kept;
  for (int v = 0; v < frame.height(); v += options.block) {
    for (int u = 0; u < frame.width(); u += options.block) {
      const int u1 = std::min(u + options.block, frame.width());
      const int v1 = std::min(v + options.block, frame.height());
      const Block block = judged(frame, agree, u, u1, v, v1);
      out.of += 4 * block.pixels;
      if (block.disagreeing <= options.share * block.pixels) continue;
      out.pixels += 4 * block.pixels;
      if (out.first_row < 0) out.first_row = v;
      if (kept.empty()) kept = frame.raw;
      out.last_row = v1 - 1;
      for (int row = v; row < v1; ++row) {
        const auto begin = kept.begin() + std::ptrdiff_t{row} * frame.width();
        std::fill(begin + u, begin + u1, std::uint16_t{0});
      }
    }
  }
  if (!kept.empty()) frame.raw = std::move(kept);
  return out;
}

SurfacesRecording::SurfacesRecording(std::unique_ptr<Recording> source,
                                     const SurfacePixelsOptions& options)
    : ForwardingRecording(std::move(source)), options_(options) {}

void SurfacesRecording::apply(DepthFrame& frame) {
  const PixelsLeftOut out = leave_surfaces(frame, options_);
  left_out_.pixels += out.pixels;
  left_out_.of += out.of;
  if (static_cast<double>(out.pixels) < options_.warned * static_cast<double>(out.of)) return;
  if (!first_) first_ = frame.stamp;
  const bool none = left_out_.first_row < 0;
  left_out_.first_row = none ? out.first_row : std::min(left_out_.first_row, out.first_row);
  left_out_.last_row = std::max(left_out_.last_row, out.last_row);
}

std::optional<Measurement> SurfacesRecording::next() {
  auto measurement = source().next();
  if (measurement) {
    if (auto* frame = std::get_if<DepthFrame>(&*measurement)) apply(*frame);
  }
  return measurement;
}

std::optional<DepthFrame> SurfacesRecording::next_depth(std::int64_t skip) {
  auto frame = source().next_depth(skip);
  if (frame) apply(*frame);
  return frame;
}

std::vector<Warning> SurfacesRecording::warnings() const {
  std::vector<Warning> all = source().warnings();
  const double share = static_cast<double>(left_out_.pixels) /
                       static_cast<double>(std::max<std::int64_t>(1, left_out_.of));
  if (!first_ || share < options_.warned) return all;
  all.push_back(
      {"depth_damaged",
       fmt::format("{:.1f} % of the depth images' pixels (rows {} to {}, first at {}) "
                   "agree with none of their neighbours: no surface, so they were left "
                   "out; check the camera's cable and the files",
                   100 * share, left_out_.first_row, left_out_.last_row, first_->to_string())});
  return all;
}

}  // namespace lamina
