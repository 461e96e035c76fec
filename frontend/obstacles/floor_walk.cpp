// One state machine a line; all thresholds in disparity, where noise is constant.
#include <lamina/frontend/obstacles/floor_walk.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = 0.017453292519943295;
// Pixels looked at before and behind an edge to call it sharp, and how many must be floor.
constexpr int kSharpWindow = 10, kSharpFloor = 9;

enum class Pixel { kMissing, kFloor, kAbove, kBelow };

// State of one walk.
class Walk {
 public:
  Walk(const ScanView& view, const WalkLine& line, std::span<const std::uint8_t> labels,
       WalkPlanes& planes, const ScanOptions& options)
      : view_(view),
        line_(line),
        labels_(labels),
        planes_(planes),
        options_(options),
        direction_(std::cos(line.azimuth), std::sin(line.azimuth)),
        noise_px_(
            static_cast<float>(options.noise_sigmas *
                               std::hypot(view.noise.disparity_sigma, view.noise.disparity_floor))),
        step_(static_cast<float>(options.max_step_m)),
        depth_(static_cast<float>(options.min_hole_depth_m)) {}

  WalkEnd run();

 private:
  Pixel classify(int i);
  bool on_floor(int i);
  bool bridged(int i);
  void accept(int i);
  WalkEnd end_at(BeamCause cause, double beyond);
  WalkEnd end_of_floor();
  double range_on_floor(double i) const;
  double floor_height(double range) const;
  bool in_shadow() const;
  bool faded(double range) const;

  const ScanView& view_;
  const WalkLine& line_;
  std::span<const std::uint8_t> labels_;
  WalkPlanes& planes_;
  const ScanOptions& options_;
  Eigen::Vector2d direction_;
  float noise_px_, step_, depth_;

  int plane_ = 0, next_plane_ = 0;
  float offset_ = 0;  // running mean of the height above the plane (m)
  float height_ = 0;  // of the pixel at hand above the plane walked on (m)
  float d_ = 0;       // its disparity
  int last_ = -1;     // last sample on floor
  double last_range_ = 0;
  int above_ = 0, below_ = 0, first_above_ = -1, first_below_ = -1;
  float below_d_ = 0, above_d_ = 0;
  int pending_ = 0, first_pending_ = -1;  // floor seen again behind a gap, not yet believed
  std::uint32_t history_ = 0;             // one bit a sample up to last_: was it floor?
};

// Horizontal distance from the camera's foot at which sample i's ray meets the floor walked on.
double Walk::range_on_floor(double i) const {
  const WalkPlane& p = planes_.planes[static_cast<std::size_t>(plane_)];
  const double u = static_cast<double>(line_.u0) + i * static_cast<double>(line_.du) - view_.cx;
  const double v = static_cast<double>(line_.v0) + i * static_cast<double>(line_.dv) - view_.cy;
  const double d = p.disparity.cast<double>().dot(Eigen::Vector3d(u, v, 1));
  if (!(d > 1e-9)) return 1e9;
  const double z = view_.noise.focal_baseline / d;
  return (view_.ray(u + view_.cx, v + view_.cy) * z).head<2>().dot(direction_);
}

double Walk::floor_height(double range) const {
  const Eigen::Vector3d p = planes_.planes[static_cast<std::size_t>(plane_)].body.cast<double>();
  const Eigen::Vector2d xy = view_.t.head<2>() + direction_ * range;
  return p.x() * xy.x() + p.y() * xy.y() + p.z();
}

// Incidence beyond which the sensor loses floor, or the end of its range.
bool Walk::faded(double range) const {
  const double h =
      static_cast<double>(planes_.planes[static_cast<std::size_t>(plane_)].camera_height);
  return range > h * std::tan(options_.grazing_deg * kDegree) ||
         std::hypot(range, h) > 0.9 * view_.noise.max_range;
}

Pixel Walk::classify(int i) {
  const float u = line_.u0 + static_cast<float>(i) * line_.du;
  const float v = line_.v0 + static_cast<float>(i) * line_.dv;
  const int pu = static_cast<int>(u + 0.5F), pv = static_cast<int>(v + 0.5F);
  const std::size_t at =
      static_cast<std::size_t>(pv) * static_cast<std::size_t>(view_.image->width) +
      static_cast<std::size_t>(pu);
  d_ = view_.image->d[at];
  if (!(d_ > 0)) return Pixel::kMissing;
  const float fu = static_cast<float>(pu) - static_cast<float>(view_.cx);
  const float fv = static_cast<float>(pv) - static_cast<float>(view_.cy);
  const WalkPlane& p = planes_.planes[static_cast<std::size_t>(plane_)];
  const float expected = p.disparity.x() * fu + p.disparity.y() * fv + p.disparity.z();
  // Above the plane by height: d - expected = height d / camera_height.
  const float px_per_m = d_ / p.camera_height;
  const float off = d_ - expected - offset_ * px_per_m;
  height_ = (d_ - expected) / px_per_m;
  next_plane_ = plane_;
  if (std::abs(off) <= std::max(noise_px_, step_ * px_per_m)) return Pixel::kFloor;
  // Another level or ramp, where it meets the surface walked on.
  const int other = labels_.empty() ? -1 : planes_.of_label[labels_[at]];
  if (other >= 0 && other != plane_) {
    const Eigen::Vector3f& q = planes_.planes[static_cast<std::size_t>(other)].body;
    const double range = last_range_ > 0 ? last_range_ : range_on_floor(i);
    const Eigen::Vector2d xy = view_.t.head<2>() + direction_ * range;
    const double there = q.cast<double>().dot(Eigen::Vector3d(xy.x(), xy.y(), 1));
    if (std::abs(there - floor_height(range)) <= options_.max_step_m + 0.02 * range) {
      next_plane_ = other;
      return Pixel::kFloor;
    }
  }
  if (off > 0) return Pixel::kAbove;
  return off < -std::max(noise_px_, depth_ * px_per_m) ? Pixel::kBelow : Pixel::kFloor;
}

void Walk::accept(int i) {
  if (next_plane_ != plane_) {
    plane_ = next_plane_;
    offset_ = height_ = 0;
  }
  const double range = range_on_floor(i);
  const double step = last_ >= 0 ? range - last_range_ : 0;
  const float share = static_cast<float>(std::clamp(step / options_.local_floor_m, 0.02, 0.5));
  offset_ += share * (std::clamp(height_, -3 * step_, 3 * step_) - offset_);
  const int ago = last_ < 0 ? 31 : std::min(31, i - last_);
  history_ = (history_ << ago) | 1U;
  planes_.planes[static_cast<std::size_t>(plane_)].entered = true;
  last_ = i;
  last_range_ = range;
  above_ = below_ = pending_ = 0;
}

// Is the unseen ground between the last floor and sample i explained?
bool Walk::bridged(int i) {
  const double range = range_on_floor(i);
  if (last_ < 0) {
    // The blind zone before the first floor.
    return range - range_on_floor(0) <= 0.5 || range < 1.2 * view_.noise.min_range;
  }
  if (i - last_ <= options_.min_run_px) return true;
  const double gap = range - last_range_;
  if (gap <= options_.max_gap_m) return true;
  return below_ == 0 && faded(last_range_) && gap <= options_.max_faded_gap_m;
}

bool Walk::on_floor(int i) {
  if (last_ >= 0 && i - last_ == 1) {
    accept(i);
    return true;
  }
  if (pending_ == 0) first_pending_ = i;
  if (++pending_ < options_.min_run_px && i - last_ > options_.min_run_px) return true;
  if (!bridged(first_pending_)) return false;
  accept(i);
  return true;
}

// A shadow at the sample behind the floor: a nearer thing beside it hides it from the second
// camera; the band is as wide (px) as the two disparities differ.
bool Walk::in_shadow() const {
  const int i = last_ + 1 + options_.min_run_px;
  const int u = static_cast<int>(line_.u0 + static_cast<float>(i) * line_.du + 0.5F);
  const int v = static_cast<int>(line_.v0 + static_cast<float>(i) * line_.dv + 0.5F);
  if (v < 0 || v >= view_.image->height) return false;
  const float* row = view_.image->row(v);
  const double floor_d = view_.noise.focal_baseline / std::max(0.1, last_range_);
  for (int k = 1; k < 100; ++k) {
    for (const int x : {u - k, u + k}) {
      if (x < 0 || x >= view_.image->width) continue;
      if (static_cast<double>(row[x]) - floor_d + 3 >= k) return true;
    }
  }
  return false;
}

WalkEnd Walk::end_at(BeamCause cause, double beyond) {
  WalkEnd end;
  end.cause = cause;
  end.sample = last_;
  if (last_ < 0) {
    end.range = end.gap = cause == BeamCause::kHole ? beyond : 0;
    end.footprint = 0.1 * end.range;
    return end;
  }
  const double next = range_on_floor(last_ + 1);
  end.range = range_on_floor(last_ + 0.5);
  end.footprint = next - last_range_;
  end.height = static_cast<float>(floor_height(end.range));
  end.gap = std::max(0.0, beyond - end.range);
  const std::uint32_t seen = history_ & ((1U << kSharpWindow) - 1);
  end.sharp = __builtin_popcount(seen) >= kSharpFloor;
  return end;
}

// The floor ended and nothing that ends it was seen right behind.
WalkEnd Walk::end_of_floor() {
  WalkEnd end = end_at(BeamCause::kEdgeOfKnowledge, 1e9);
  if (last_ < 0) return end;
  end.sharp = end.sharp && !faded(end.range);
  end.shadow = end.sharp && in_shadow();
  return end;
}

WalkEnd Walk::run() {
  int i = 0;
  for (; i < line_.samples; ++i) {
    const Pixel pixel = classify(i);
    if (pixel == Pixel::kFloor) {
      if (!on_floor(i)) return end_of_floor();
      continue;
    }
    if (pixel == Pixel::kMissing) continue;
    pending_ = 0;
    if (pixel == Pixel::kAbove) {
      if (above_++ == 0) {
        first_above_ = i;
        above_d_ = d_;
      }
      if (above_ < options_.min_run_px) continue;
      const double u = static_cast<double>(line_.u0 + static_cast<float>(first_above_) * line_.du);
      const double v = static_cast<double>(line_.v0 + static_cast<float>(first_above_) * line_.dv);
      const double range =
          (view_.point(u, v, static_cast<double>(above_d_)) - view_.t).head<2>().dot(direction_);
      if (last_ >= 0 &&
          range - last_range_ > options_.max_gap_m + 2 * (range_on_floor(last_ + 1) - last_range_))
        return end_of_floor();
      return end_at(BeamCause::kObstacle, range);
    }
    if (below_++ == 0) {
      first_below_ = i;
      below_d_ = d_;
    }
    if (below_ < options_.min_run_px) continue;
    const double beyond = range_on_floor(first_below_ - 0.5);
    WalkEnd end = end_at(BeamCause::kHole, beyond);
    // Where the sensor fades the rim lies somewhere in the gap.
    if (last_ >= 0 && end.gap > 0 && (!end.sharp || faded(end.range))) {
      const double shift = std::min(0.5 * end.gap, options_.max_faded_gap_m);
      end.range += shift;
      end.footprint = std::max(end.footprint, shift);
    }
    return end;
  }
  return last_ < 0 ? WalkEnd() : end_of_floor();
}

bool alike(const WalkEnd& a, const WalkEnd& b, double footprints) {
  return std::abs(a.range - b.range) <= footprints * std::max(a.footprint, b.footprint);
}

}  // namespace

WalkPlanes walk_planes(const FloorResult& floor, const ScanView& view, const ScanOptions& options) {
  WalkPlanes out;
  out.of_label.assign(256, -1);
  if (floor.dominant < 0) return out;
  const SE3 T = view.T_body_camera;
  const auto add = [&](std::size_t k) {
    const ExtractedPlane& p = floor.planes[k];
    const Eigen::Vector3d n = T.so3() * p.plane_camera.normal();
    if (n.z() < std::cos(options.max_slope_deg * kDegree) || out.planes.size() > 30) return;
    const double rho = p.plane_camera.rho() + n.dot(T.translation());
    WalkPlane w;
    w.disparity = p.disparity.cast<float>();
    w.body = Eigen::Vector3d(-n.x() / n.z(), -n.y() / n.z(), rho / n.z()).cast<float>();
    w.camera_height = static_cast<float>(-p.plane_camera.rho());
    if (!(w.camera_height > 0.01F)) return;
    if (k < 255) out.of_label[k + 1] = static_cast<std::int16_t>(out.planes.size());
    out.planes.push_back(w);
  };
  add(static_cast<std::size_t>(floor.dominant));
  if (out.planes.empty()) return out;
  for (std::size_t k = 0; k < floor.planes.size(); ++k) {
    const ExtractedPlane& p = floor.planes[k];
    if (static_cast<int>(k) == floor.dominant || p.area < options.min_level_area_m2) continue;
    if (p.kind == PlaneKind::kSubDominant) add(k);
  }
  return out;
}

WalkEnd walk(const ScanView& view, const WalkLine& line, std::span<const std::uint8_t> labels,
             WalkPlanes& planes, const ScanOptions& options) {
  if (planes.planes.empty()) return {};
  return Walk(view, line, labels, planes, options).run();
}

void find_ledges(const ScanView&, const std::vector<WalkLine>&, const ScanOptions& options,
                 std::vector<WalkEnd>& ends) {
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

End2 in_body(const ScanView& view, double azimuth, double range) {
  const double x = view.t.x() + range * std::cos(azimuth),
               y = view.t.y() + range * std::sin(azimuth);
  return {std::atan2(y, x), std::hypot(x, y)};
}

void put(ObstacleScan& out, int beam, double range, const WalkEnd& end) {
  if (beam < 0 || range > out.range_max) return;
  const std::size_t b = static_cast<std::size_t>(beam);
  const bool knowledge = end.cause == BeamCause::kEdgeOfKnowledge;
  const bool held = out.cause[b] != BeamCause::kNone && out.cause[b] != BeamCause::kEdgeOfKnowledge;
  if (knowledge && held) return;
  if (held == !knowledge && static_cast<double>(out.range[b]) <= range) return;
  out.range[b] = static_cast<float>(range);
  out.cause[b] = end.cause;
  // Half a footprint either way, uniform, and half a pixel of lateral jitter [Barron2013].
  out.sigma[b] = static_cast<float>(std::max(0.003, 0.58 * end.footprint));
  out.height[b] = end.height;
}

}  // namespace

void draw_ends(const ScanView& view, const std::vector<WalkLine>& lines,
               const std::vector<WalkEnd>& ends, ObstacleScan& out) {
  for (std::size_t j = 0; j < ends.size(); ++j) {
    const WalkEnd& e = ends[j];
    if (e.cause == BeamCause::kNone) continue;
    const End2 a = in_body(view, lines[j].azimuth, e.range);
    const bool counts = e.cause != BeamCause::kObstacle;
    const int at = out.beam_of(a.angle);
    if (counts) put(out, at, a.range, e);
    if (at >= 0 && e.sample >= 0) {
      float& reach = out.floor_range[static_cast<std::size_t>(at)];
      reach =
          reach > 0 ? std::min(reach, static_cast<float>(a.range)) : static_cast<float>(a.range);
    }
    if (j + 1 >= ends.size() || ends[j + 1].cause == BeamCause::kNone) continue;
    // The beams between two ends that belong together.
    const WalkEnd& f = ends[j + 1];
    const End2 b = in_body(view, lines[j + 1].azimuth, f.range);
    const int to = out.beam_of(b.angle);
    if (at < 0 || to < 0 || std::abs(to - at) < 2 || std::abs(to - at) > 20) continue;
    const bool joined = alike(e, f, 4) || std::abs(a.range - b.range) < 0.1;
    const bool drawn = counts && f.cause != BeamCause::kObstacle && joined;
    const int way = to > at ? 1 : -1;
    for (int beam = at + way; beam != to; beam += way) {
      const double x = (out.angle(static_cast<std::size_t>(beam)) - a.angle) / (b.angle - a.angle);
      const double range = a.range + (b.range - a.range) * std::clamp(x, 0.0, 1.0);
      if (drawn) put(out, beam, range, e);
      float& reach = out.floor_range[static_cast<std::size_t>(beam)];
      if (e.sample >= 0 && reach == 0) reach = static_cast<float>(std::min(a.range, b.range));
    }
  }
}

}  // namespace lamina
