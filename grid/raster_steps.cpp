// Where discs lie astride a step: the cell is of the level below it or of the one above.
#include <algorithm>
#include <cmath>
#include <optional>

#include <lamina/grid/raster_shapes.hpp>

namespace lamina::raster {
namespace {

struct Profile {
  const DiscDistance& discs;
  int i, j;    // cell of the tile
  int di, dj;  // one cell along
  float at(int k) const { return discs.disc(i + k * di, j + k * dj); }
};

// The nearest row of level cells that begins no more than `width` cells along, a patch; its first
// cell. It is longer than half a patch: of two discs at least.
std::optional<int> plateau(const Profile& profile, int side, int width, float uneven) {
  for (int k = 1; k <= width; ++k) {
    float low = profile.at(side * k), high = low;
    for (int m = 1; m <= width / 2; ++m) {
      const float height = profile.at(side * (k + m));
      low = std::min(low, height);
      high = std::max(high, height);
      if (!(height == height)) high = height;  // NaN: nothing lies there
    }
    if (high - low <= uneven) return side * k;
  }
  return std::nullopt;
}

// The two levels that the cell lies between, along one line through it, no further apart than a
// patch is wide.
struct Step {
  float low = 0, high = 0;
  float rise() const { return high - low; }
};
std::optional<Step> step_along(const Profile& profile, const Trend& trend,
                               const RasterOptions& options) {
  const int width = static_cast<int>(std::lround(options.patch_size / options.resolution));
  const auto least = static_cast<float>(options.least_step);
  const float rise = std::abs(profile.at(width) - profile.at(-width));
  if (!(rise >= least)) return std::nullopt;
  const float uneven = static_cast<float>(options.least_even) * rise;
  const auto up = plateau(profile, 1, width, uneven), down = plateau(profile, -1, width, uneven);
  if (!up || !down || *up - *down > width + 1) return std::nullopt;
  const float a = profile.at(*up), b = profile.at(*down);
  const Step step{std::min(a, b), std::max(a, b)};
  const float expected =
      static_cast<float>(options.resolution) * Trend::kUnit *
      static_cast<float>((*up - *down) * (trend.x * profile.di + trend.y * profile.dj));
  const bool carried = 2 * std::abs(expected) >= step.rise();  // a ramp that is a plane
  return step.rise() >= least && !carried ? std::optional(step) : std::nullopt;
}

// Of all lines through the cell the one with the largest step.
std::optional<Step> step_at(const DiscDistance& discs, int i, int j, const Trend& trend,
                            const RasterOptions& options) {
  std::optional<Step> best;
  for (const auto& [di, dj] :
       {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1), std::pair(1, -1)}) {
    const auto step = step_along({discs, i, j, di, dj}, trend, options);
    if (step && (!best || step->rise() > best->rise())) best = step;
  }
  return best;
}

// The side of it that a height of this variance lies on; itself where it is not surely between.
float side_of(const Step& step, float height, float variance, const RasterOptions& options) {
  const float least = std::max(static_cast<float>(options.least_even) * step.rise(),
                               kSignificant * std::sqrt(2 * variance));
  if (step.rise() > options.level_gap || height <= step.low + least || height >= step.high - least)
    return height;
  return height < 0.5F * (step.low + step.high) ? step.low : step.high;
}

}  // namespace

void DiscDistance::sharpen(const RasterOptions& options) {
  std::vector<float> sharp = height_;
  for (int j = -margin_; j < kSide + margin_; ++j) {
    for (int i = -margin_; i < kSide + margin_; ++i) {
      const std::size_t k = index(i, j);
      if (distance_[k] != 0.0F) continue;
      if (const auto step = step_at(*this, i, j, trend_[k], options))
        sharp[k] = side_of(*step, height_[k], variance_[k], options);
    }
  }
  measured_.swap(height_);
  height_.swap(sharp);
}

void sharpen_levels(const Canvas& canvas) {
  for (int cell = 0; cell < kCells; ++cell) {
    const int i = cell % kSide, j = cell / kSide;
    const float height = canvas.discs.disc(i, j), measured = canvas.discs.measured(i, j);
    if (!(height == height) || height == measured) continue;
    for (Level& level : canvas.tile.levels_at(cell)) {
      Support& s = level.surface;
      const bool there = std::abs(s.height - measured) <= std::abs(height - measured);
      if (s.from_plane() || !there) continue;
      s.height = height;
      s.slope_x = Trend::kUnit * static_cast<float>(s.trend.x);
      s.slope_y = Trend::kUnit * static_cast<float>(s.trend.y);
    }
  }
}

namespace {

// What a loose point is of: the surface no further from it than a step, else the lowest above it,
// whose face it lies on, no higher than edges are known to.
float settled(float height, int i, int j, const Canvas& canvas) {
  const int beside = static_cast<int>(std::lround(kAstride / canvas.options.resolution));
  float off = static_cast<float>(canvas.options.max_step), near = height;
  float face = height + static_cast<float>(kAstride), above = face;
  for (int v = j - beside; v <= j + beside; ++v) {
    for (int u = i - beside; u <= i + beside; ++u) {
      const float disc = canvas.discs.disc(u, v);
      if (std::abs(disc - height) <= off) off = std::abs(disc - height), near = disc;
      if (disc > height && disc < above) above = disc;
    }
  }
  return near != height || above == face ? near : above;
}

}  // namespace

void settle_points(Canvas& canvas) {
  for (Obstacle& point : canvas.points) {
    point.high = settled(point.high, point.cell % kSide, point.cell / kSide, canvas);
    point.low = std::min(point.low, point.high);
  }
}

}  // namespace lamina::raster
