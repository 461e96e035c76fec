// What neighbouring walks say together: ledges, holes that hold, smooth rims, beams.
#include <lamina/frontend/obstacles/floor_walk.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = 0.017453292519943295;

bool alike(const WalkEnd& a, const WalkEnd& b, double footprints) {
  return std::abs(a.range - b.range) <= footprints * std::max(a.footprint, b.footprint);
}

}  // namespace

void find_ledges(const ScanOptions& options, std::vector<WalkEnd>& ends) {
  constexpr int kNeighbours = 4, kNeeded = 6;
  const auto candidate = [&](const WalkEnd& e) {
    return (e.cause == BeamCause::kEdgeOfKnowledge && e.sharp && !e.shadow) ||
           (e.cause == BeamCause::kHole && e.sharp);
  };
  std::vector<std::size_t> ledges;
  for (std::size_t j = 0; j < ends.size(); ++j) {
    if (ends[j].cause != BeamCause::kEdgeOfKnowledge || !candidate(ends[j])) continue;
    if (ends[j].gap <= options.max_gap_m) continue;
    int agree = 0;
    for (const int side : {-1, 1}) {
      const WalkEnd* last = &ends[j];
      for (int k = 1; k <= kNeighbours; ++k) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(j) + side * k;
        if (at < 0 || at >= static_cast<std::ptrdiff_t>(ends.size())) break;
        const WalkEnd& e = ends[static_cast<std::size_t>(at)];
        if (!candidate(e) || !alike(e, *last, 3)) continue;
        last = &e;
        ++agree;
      }
    }
    if (agree >= kNeeded) ledges.push_back(j);
  }
  for (const std::size_t j : ledges) ends[j].cause = BeamCause::kLedge;
}

namespace {

constexpr std::ptrdiff_t kAround = 4;

// Floor that thins out before it ends was lost by the sensor; floor that stops has a rim. Share of
// the pixels that were floor, over the neighbours' last samples before `reach`.
bool thins_out(const std::vector<WalkEnd>& ends, std::ptrdiff_t j, double reach) {
  constexpr int kSamples = 6;
  constexpr double kThin = 0.15;
  int seen = 0, all = 0;
  for (std::ptrdiff_t k = j - kAround; k <= j + kAround; ++k) {
    if (k < 0 || k >= static_cast<std::ptrdiff_t>(ends.size())) continue;
    const WalkEnd& e = ends[static_cast<std::size_t>(k)];
    if (e.sample < 0 || !(e.footprint > 0)) continue;
    all += kSamples;
    for (int b = 0; b < kSamples; ++b) {
      const double range = e.range - (b + 0.5) * e.footprint;
      if (range < reach - kSamples * e.footprint) break;
      seen += static_cast<int>((e.history >> b) & 1U);
    }
  }
  return all > 0 && seen < kThin * all;
}

// Do the virtual floor points of the neighbours that see below lie on one rim with this one's? Then
// the floor before them was lost by fading alone: whatever else hides ground has no straight rim.
bool in_line(const std::vector<WalkEnd>& ends, std::ptrdiff_t j) {
  constexpr int kNeeded = 5;
  const WalkEnd& mine = ends[static_cast<std::size_t>(j)];
  int agree = 0;
  for (const int side : {-1, 1}) {
    const WalkEnd* last = &mine;
    for (std::ptrdiff_t k = j + side; std::abs(k - j) <= kAround; k += side) {
      if (k < 0 || k >= static_cast<std::ptrdiff_t>(ends.size())) break;
      const WalkEnd& e = ends[static_cast<std::size_t>(k)];
      if (e.cause != BeamCause::kHole || !(e.beyond > 0)) continue;
      const double room = 2.5 * std::max(e.beyond_footprint, last->beyond_footprint);
      if (std::abs(e.beyond - last->beyond) > room) continue;
      last = &e;
      ++agree;
    }
  }
  return agree >= kNeeded;
}

}  // namespace

namespace {

// Calls `take` with the four lines to each side, at most eight away, that have something to say
// about this one's rim: those that ended before it, at a post or where the floor was lost, have
// not.
template <class Take>
void neighbours_of(const std::vector<WalkEnd>& ends, std::ptrdiff_t j, const Take& take) {
  constexpr std::ptrdiff_t kLook = 8;
  const WalkEnd& mine = ends[static_cast<std::size_t>(j)];
  for (const std::ptrdiff_t way : {-1, 1}) {
    std::ptrdiff_t found = 0;
    for (std::ptrdiff_t k = j + way; std::abs(k - j) <= kLook && found < kAround; k += way) {
      if (k < 0 || k >= static_cast<std::ptrdiff_t>(ends.size())) break;
      const WalkEnd& e = ends[static_cast<std::size_t>(k)];
      if (!is_negative(e.cause) && e.range < std::max(mine.range, mine.beyond)) continue;
      take(e);
      ++found;
    }
  }
}

// Where floor was lost by fading alone the rim lies between what was seen of it last and the first
// ground seen below; that is half a pixel late for its sample, and half a pixel for the jitter
// [Barron2013]: the nearest of the neighbours', less a footprint.
double rim_before_ground_below(const std::vector<WalkEnd>& ends, std::ptrdiff_t j) {
  const WalkEnd& mine = ends[static_cast<std::size_t>(j)];
  double least = mine.beyond;
  neighbours_of(ends, j, [&](const WalkEnd& e) {
    if (e.cause != BeamCause::kHole || !(e.beyond > 0)) return;
    const double room = 2.5 * std::max(e.beyond_footprint, mine.beyond_footprint);
    if (std::abs(e.beyond - mine.beyond) <= room) least = std::min(least, e.beyond);
  });
  return least - mine.beyond_footprint;
}

// One line alone that puts the rim far behind its neighbours' has seen less, not more: where floor
// fades, no rim is farther than the upper quartile of those around it.
void draw_in_alone(std::vector<WalkEnd>& ends) {
  const std::vector<WalkEnd> raw = ends;
  const std::ptrdiff_t n = static_cast<std::ptrdiff_t>(raw.size());
  for (std::ptrdiff_t j = 0; j < n; ++j) {
    WalkEnd& end = ends[static_cast<std::size_t>(j)];
    if (end.cause != BeamCause::kHole || !end.faded) continue;
    std::array<double, 2 * kAround + 1> around;
    std::ptrdiff_t count = 0;
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(0, j - kAround);
         k <= std::min(n - 1, j + kAround); ++k) {
      const WalkEnd& e = raw[static_cast<std::size_t>(k)];
      if (e.cause == BeamCause::kHole) around[static_cast<std::size_t>(count++)] = e.range;
    }
    std::nth_element(around.begin(), around.begin() + 3 * count / 4, around.begin() + count);
    end.range = std::min(end.range, around[static_cast<std::size_t>(3 * count / 4)]);
  }
}

}  // namespace

void settle_holes(const WalkPlanes& planes, const ScanOptions& options,
                  std::vector<WalkEnd>& ends) {
  constexpr int kNeeded = 4;
  const std::vector<WalkEnd> raw = ends;
  const std::ptrdiff_t n = static_cast<std::ptrdiff_t>(raw.size());
  for (std::ptrdiff_t j = 0; j < n; ++j) {
    WalkEnd& end = ends[static_cast<std::size_t>(j)];
    if (end.cause != BeamCause::kHole) continue;
    int agree = 0;
    double reach = end.range;
    neighbours_of(raw, j, [&](const WalkEnd& e) {
      if (!is_negative(e.cause)) return;
      const bool near = alike(e, end, 6) || std::abs(e.range - end.range) < 0.05;
      agree += near || (e.faded && end.faded);
      if (e.faded && e.range < end.beyond) reach = std::max(reach, e.range);
    });
    if (agree < kNeeded) {
      end.cause = BeamCause::kEdgeOfKnowledge;
      end.barred = true;
      continue;
    }
    if (!end.faded || end.sample < 0) continue;
    // A fading sensor shows the rim late or not at all: the farthest floor of the neighbours, or,
    // where no floor can be seen any more, what the virtual floor says.
    end.footprint = std::max(end.footprint, 0.3 * (reach - end.range));
    const double rim = rim_before_ground_below(raw, j);
    end.range = std::min(reach, std::max(rim, end.range));
    const double gap = rim - reach;
    const WalkPlane& plane = planes.planes[static_cast<std::size_t>(end.plane)];
    const double lost =
        static_cast<double>(plane.camera_height) * std::tan(options.lost_deg * kDegree);
    const bool lost_here = reach >= lost || (thins_out(raw, j, reach) && in_line(raw, j));
    if (!lost_here || gap <= 0) {
      end.unseen = std::max(0.0, rim - end.range);
      continue;
    }
    end.range = gap > 2 * options.max_faded_gap_m ? rim : reach + 0.5 * gap;
    end.footprint = std::max(end.footprint, 0.3 * gap);
  }
  draw_in_alone(ends);
}

void extend_rims(std::vector<WalkEnd>& ends) {
  const auto extend = [](const WalkEnd& from, WalkEnd& to) {
    if (!is_negative(from.cause) || is_negative(to.cause)) return;
    for (int k = 0; k < to.bridges; ++k) {
      const double range = static_cast<double>(to.bridged[static_cast<std::size_t>(k)]);
      if (std::abs(range - from.range) > 3 * from.footprint) continue;
      to.cause = from.cause;
      to.range = range;
      to.footprint = from.footprint;
      to.unseen = from.unseen;
      to.height = from.height;
      return;
    }
  };
  for (std::size_t j = 1; j < ends.size(); ++j) extend(ends[j - 1], ends[j]);
  for (std::size_t j = ends.size(); j-- > 1;) extend(ends[j], ends[j - 1]);
}

void smooth_edges(std::vector<WalkEnd>& ends) {
  const std::vector<WalkEnd> raw = ends;
  for (std::size_t j = 0; j < raw.size(); ++j) {
    if (!is_negative(raw[j].cause) || raw[j].sample < 0) continue;
    double sum = raw[j].range, weight = 1;
    // In pairs, so that an oblique rim is not pulled to one side.
    for (std::size_t k = 1; k <= 2; ++k) {
      if (j < k || j + k >= raw.size()) break;
      const WalkEnd &a = raw[j - k], &b = raw[j + k];
      if (!is_negative(a.cause) || !is_negative(b.cause)) break;
      if (!alike(a, raw[j], 2.5) || !alike(b, raw[j], 2.5)) break;
      sum += a.range + b.range;
      weight += 2;
    }
    ends[j].range = sum / weight;
    ends[j].footprint = raw[j].footprint / std::sqrt(weight);
  }
}

namespace {

struct End2 {
  double angle = 0, range = 0;
};

End2 in_body(const ScanView& view, const WalkLine& line, double range) {
  const double x = view.t.x() + range * line.direction.x(),
               y = view.t.y() + range * line.direction.y();
  return {std::atan2(y, x), std::hypot(x, y)};
}

void put(ObstacleScan& out, std::vector<std::uint8_t>& barred, int beam, double range,
         const WalkEnd& end) {
  if (beam < 0 || range > out.range_max) return;
  const std::size_t b = static_cast<std::size_t>(beam);
  const bool knowledge = end.cause == BeamCause::kEdgeOfKnowledge;
  const bool held = out.cause[b] != BeamCause::kNone && out.cause[b] != BeamCause::kEdgeOfKnowledge;
  if (knowledge && held) return;
  if (held == !knowledge && static_cast<double>(out.range[b]) <= range) return;
  out.range[b] = static_cast<float>(range);
  out.cause[b] = end.cause;
  barred[b] = end.barred;
  // Half a footprint either way, uniform, and half a pixel of lateral jitter [Barron2013]; or
  // anywhere on the unseen ground, uniform (1 / sqrt 12).
  out.sigma[b] = static_cast<float>(std::max({0.003, 0.58 * end.footprint, 0.29 * end.unseen}));
  out.height[b] = end.height;
}

}  // namespace

void draw_ends(const ScanView& view, const std::vector<WalkLine>& lines,
               const std::vector<WalkEnd>& ends, ObstacleScan& out,
               std::vector<std::uint8_t>& barred) {
  barred.assign(out.size(), 0);
  for (std::size_t j = 0; j < ends.size(); ++j) {
    const WalkEnd& e = ends[j];
    if (e.cause == BeamCause::kNone) continue;
    const End2 a = in_body(view, lines[j], e.range);
    const int at = out.beam_of(a.angle);
    put(out, barred, at, a.range, e);
    if (at >= 0 && e.sample >= 0) {
      float& reach = out.floor_range[static_cast<std::size_t>(at)];
      reach =
          reach > 0 ? std::min(reach, static_cast<float>(a.range)) : static_cast<float>(a.range);
    }
    if (j + 1 >= ends.size() || ends[j + 1].cause == BeamCause::kNone) continue;
    // The beams between two ends that belong together.
    const WalkEnd& f = ends[j + 1];
    const End2 b = in_body(view, lines[j + 1], f.range);
    const int to = out.beam_of(b.angle);
    if (at < 0 || to < 0 || std::abs(to - at) < 2 || std::abs(to - at) > 20) continue;
    const bool joined = alike(e, f, 4) || std::abs(a.range - b.range) < 0.1;
    const bool drawn = e.cause != BeamCause::kObstacle && f.cause != BeamCause::kObstacle;
    const int way = to > at ? 1 : -1;
    for (int beam = at + way; beam != to; beam += way) {
      const double x = (out.angle(static_cast<std::size_t>(beam)) - a.angle) / (b.angle - a.angle);
      const double range = joined ? a.range + (b.range - a.range) * std::clamp(x, 0.0, 1.0)
                                  : std::min(a.range, b.range);
      if (drawn) put(out, barred, beam, range, e);
      float& reach = out.floor_range[static_cast<std::size_t>(beam)];
      if (e.sample >= 0 && reach == 0) reach = static_cast<float>(std::min(a.range, b.range));
    }
  }
}

}  // namespace lamina
