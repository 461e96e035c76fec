// The layers of one cell, from its site and those around.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <lamina/grid/raster_tile.hpp>

namespace lamina::raster {
namespace {

constexpr float kSure = 5;           // sigma: beyond, probabilities are 0 or 1
constexpr float kLow = 0.12F;        // m: higher things stand there, they are no steps
constexpr double kMost = kSide / 4;  // cells, whatever the resolution: a tile's neighbours must do
constexpr float kRounding = 1e-6F;   // m, of heights in float: a step of exactly T is one

// Of the standard normal from -kSure to kSure, read off a table to 3e-6: a sixth of all time went
// into the error function.
float normal_cdf(float z) {
  constexpr int kPieces = 1000;
  constexpr float kPerSigma = kPieces / (2 * kSure);
  static const std::array<float, kPieces + 2> table = [] {
    std::array<float, kPieces + 2> values{};
    for (int k = 0; k < kPieces + 2; ++k) {
      const double x = static_cast<double>(k) / static_cast<double>(kPerSigma) - 5.0;
      values[static_cast<std::size_t>(k)] = static_cast<float>(0.5 * std::erfc(-x * M_SQRT1_2));
    }
    return values;
  }();
  static_assert(kSure == 5);
  if (!(z > -kSure)) return 0;
  if (z >= kSure) return 1;
  const float place = (z + kSure) * kPerSigma;
  const auto k = static_cast<std::size_t>(place);
  return table[k] + (place - static_cast<float>(k)) * (table[k + 1] - table[k]);
}

// P(|d + e| <= T), e ~ N(0, variance). Cells of one surface share its error: only its tilt is left.
float step_probability(const Site& a, const Site& b, float distance, float T) {
  const float d = std::abs(a.height - b.height);
  const float variance =
      a.source == b.source ? a.tilt_variance * distance * distance : a.variance + b.variance;
  const float room = T + kRounding - d;
  if (room * room >= kSure * kSure * variance) return room >= 0 ? 1.0F : 0.0F;
  const float sigma = std::sqrt(variance);
  return normal_cdf(room / sigma) + normal_cdf((T + kRounding + d) / sigma) - 1;
}

// A robot comes up to its edge, whatever stands there.
bool is_step(const Site& other, float rise, float T) {
  return other.blocked && rise > T && (rise <= kLow || other.surface_above);
}

float slope_probability(const Site& site, float slope, const RasterOptions& options) {
  const float room = static_cast<float>(options.max_slope) + kRounding - slope;
  // d atan(s) = ds cos^2.
  const float c = std::cos(slope), variance = site.tilt_variance * c * c * c * c;
  if (room * room >= kSure * kSure * variance) return room >= 0 ? 1.0F : 0.0F;
  return normal_cdf(room / std::sqrt(variance));
}

// Floor seen on all sides of an edge, without a step, says that there is none (any more).
bool refuted(const SitesAround& around, const RasterOptions& options) {
  const Site* site = around.at(0, 0);
  for (int dj = -2; dj <= 2; ++dj) {
    for (int di = -2; di <= 2; ++di) {
      const Site* other = around.at(di, dj);
      if (other == nullptr || !other->supported ||
          // A plane's fill saw nothing here itself.
          (other->source % 2 != 0 && std::max(std::abs(di), std::abs(dj)) < 2) ||
          std::abs(other->height - site->height) > 2 * static_cast<float>(options.max_step)) {
        return false;
      }
    }
  }
  return true;
}

// Between things not three cells apart: the inside of a thin wall more often than a gap, and
// nothing for a robot either way.
bool squeezed(const SitesAround& around) {
  const auto solid = [&](int di, int dj) {
    for (int k = 1; k <= 2; ++k) {
      const Site* other = around.at(k * di, k * dj);
      if (other != nullptr && other->blocked) return true;
    }
    return false;
  };
  for (const auto& [di, dj] :
       {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1), std::pair(1, -1)}) {
    if (solid(di, dj) && solid(-di, -dj)) return true;
  }
  return false;
}

// Where an edge lies is known to a margin: what is that near to one is not free either.
bool beside_step(const SitesAround& around, const RasterOptions& options) {
  const int reach = edge_cells(options);
  const auto blocked = static_cast<float>(1 - options.min_probability);
  for (int dj = -reach; dj <= reach; ++dj) {
    for (int di = -reach; di <= reach; ++di) {
      const Site* other = around.at(di, dj);
      if (other != nullptr && other->supported && other->step <= blocked) return true;
    }
  }
  return false;
}

// Quick: the heights up to two cells away, by what the four diagonal neighbours know of those
// beside them, rise by no more than `rise`.
bool level_within_two(const SitesAround& around, float rise) {
  const Site* site = around.at(0, 0);
  float low = site->low, high = site->high;
  for (const auto& [di, dj] :
       {std::pair(-1, -1), std::pair(1, -1), std::pair(-1, 1), std::pair(1, 1)}) {
    const Site* other = around.at(di, dj);
    if (other == nullptr || !other->supported) return false;
    low = std::min(low, other->low);
    high = std::max(high, other->high);
  }
  return high - low <= rise;
}

// Surfels are made of patches: of one that lies astride a step the points of both sides are
// levelled out, and a step looks like a ramp of that length. What rises by more than T within it,
// beyond doubt and beyond what the planes of the two say that it should, may be one.
bool hidden_step(const SitesAround& around, const RasterOptions& options) {
  const int reach = patch_cells(options);
  const Site* site = around.at(0, 0);
  const auto T = static_cast<float>(options.max_step) + kRounding;
  const auto counts = [site](const Site* other) {
    return other != nullptr && other->supported && !other->surface_above &&
           std::abs(other->height - site->height) <= kLow;
  };
  if (reach <= 2 && level_within_two(around, T)) return false;
  float least = site->height, most = least;  // first without their places: it seldom goes on
  for (int dj = -reach; dj <= reach; ++dj) {
    for (int di = -reach; di <= reach; ++di) {
      const Site* other = around.at(di, dj);
      const float height = counts(other) ? other->height : least;
      least = std::min(least, height);
      most = std::max(most, height);
    }
  }
  const float rise = most - least;
  if (rise <= T) return false;
  const Site *low = nullptr, *high = nullptr;
  int i = 0, j = 0, u = 0, v = 0;  // theirs
  for (int dj = -reach; dj <= reach; ++dj) {
    for (int di = -reach; di <= reach; ++di) {
      const Site* other = around.at(di, dj);
      if (!counts(other)) continue;
      if (low == nullptr && other->height == least) low = other, i = di, j = dj;
      if (high == nullptr && other->height == most) high = other, u = di, v = dj;
    }
  }
  const float half = 0.5F * static_cast<float>(options.resolution) * Trend::kUnit;
  const float expected = half * static_cast<float>((low->trend.x + high->trend.x) * (u - i) +
                                                   (low->trend.y + high->trend.y) * (v - j));
  const float beyond = rise - std::clamp(expected, 0.0F, rise) - T;
  return beyond > 0 && beyond * beyond > low->variance + high->variance;
}

float factor(const Site& site, float slope, const RasterOptions& options) {
  const float rise = (site.height - site.reference) / static_cast<float>(options.robot_height);
  const auto steep = static_cast<float>(options.steep_slope);
  const auto least = static_cast<float>(options.steep_factor);
  if (slope > steep) return 0;
  return std::clamp(1 - rise, 0.0F, 1.0F) * (1 - (1 - least) * slope / steep);
}

NavigabilityCell never(NavigabilityCell cell, float confidence) {
  cell.navigability = 0;
  cell.confidence = confidence;
  return cell;
}

}  // namespace

int edge_cells(const RasterOptions& options) {
  return static_cast<int>(std::lround(std::min(options.edge_margin / options.resolution, kMost)));
}

int patch_cells(const RasterOptions& options) {
  return static_cast<int>(
      std::lround(std::min(0.5 * options.patch_size / options.resolution, kMost)));
}

void look_around(const SitesAround& around, const RasterOptions& options, Site& site) {
  const auto r = static_cast<float>(options.resolution), T = static_cast<float>(options.max_step);
  site.complete = true;
  site.step = 1;
  site.low = site.high = site.height;
  if (!site.supported) return;
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      if (di == 0 && dj == 0) continue;
      const Site* other = around.at(di, dj);
      if (other == nullptr || (!other->supported && !other->blocked)) {
        site.complete = false;
        continue;
      }
      if (other->met) site.complete = false;
      if (is_step(*other, other->top - site.height, T)) site.step = 0;
      if (!other->supported) continue;
      site.low = std::min(site.low, other->height);
      site.high = std::max(site.high, other->height);
      const float distance = r * (di != 0 && dj != 0 ? 1.41421356F : 1.0F);
      site.step = std::min(site.step, step_probability(site, *other, distance, T));
    }
  }
}

NavigabilityCell verdict(const SitesAround& around, const RasterOptions& options,
                         UnknownCause* unknown_cause) {
  UnknownCause ignored;
  UnknownCause& why = unknown_cause != nullptr ? *unknown_cause : ignored;
  why = UnknownCause::kNotSeen;
  NavigabilityCell cell;
  const Site* site = around.at(0, 0);
  if (site == nullptr) return cell;
  const auto there = static_cast<float>(options.obstacle_confidence);
  if (site->supported || site->blocked) cell.height = site->top;
  const float slope = std::atan(std::hypot(site->slope_x, site->slope_y));
  if (site->supported) cell.slope = slope;
  if (site->blocked) return why = UnknownCause::kNone, never(cell, there);
  const bool edge = site->flags != 0 && !(site->supported && refuted(around, options));
  if (edge && (site->flags & kRim) != 0) return why = UnknownCause::kNone, never(cell, there);
  if (!site->supported) return cell;
  why = UnknownCause::kNone;

  // Below the floor around and not connected to it: a pit, or stairs that go down.
  if (!site->reached && site->height < site->reference - static_cast<float>(options.max_step)) {
    // Nothing tells how two floors that nothing joins lie to each other but for their poses.
    const double clear = site->from_afar ? options.level_gap : options.max_step;
    const float depth = site->reference - site->height - static_cast<float>(clear);
    if (!(depth > 0)) return why = UnknownCause::kStep, cell;
    return never(cell, site->variance > 0 ? normal_cdf(depth / std::sqrt(site->variance)) : 1.0F);
  }
  const float level = slope_probability(*site, slope, options);
  const float p = std::min(site->step, level);
  const auto sure = static_cast<float>(options.min_probability);
  if (p <= 1 - sure) return never(cell, 1 - p);
  why = edge                           ? UnknownCause::kEdge
        : !site->complete || site->met ? UnknownCause::kNeighbourNotSeen
        : site->step < sure            ? UnknownCause::kStep
        : level < sure                 ? UnknownCause::kSlope
        : beside_step(around, options) ? UnknownCause::kBesideStep
        : hidden_step(around, options) ? UnknownCause::kHiddenStep
        : squeezed(around)             ? UnknownCause::kSqueezed
                                       : UnknownCause::kNone;
  if (why != UnknownCause::kNone) return cell;
  cell.navigability = factor(*site, slope, options);
  cell.confidence = p;
  return cell;
}

}  // namespace lamina::raster
