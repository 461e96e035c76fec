// One state machine a line; all thresholds in disparity, where noise is constant.
#include <lamina/frontend/obstacles/floor_walk.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/obstacles/line_samples.hpp>
#include <lamina/models/lanes.hpp>

namespace lamina {
namespace {

using namespace lanes;

constexpr double kDegree = 0.017453292519943295;
// Pixels looked at before and behind an edge to call it sharp, and how many must be floor.
constexpr int kSharpWindow = 10, kSharpFloor = 9;

// Samples after which the running mean of the floor is brought up to date.
constexpr int kFollowEvery = 4;
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
        samples_(view, line),
        noise_px_(
            static_cast<float>(options.noise_sigmas *
                               std::hypot(view.noise.disparity_sigma, view.noise.disparity_floor))),
        per_local_(static_cast<float>(1 / options.local_floor_m)),
        step_(static_cast<float>(options.max_step_m)),
        depth_(static_cast<float>(options.min_hole_depth_m)) {
    // A floor taken from the tracked mounting is not this frame's own.
    step_ += planes.slack;
    depth_ += planes.slack;
    follow(0);
  }

  WalkEnd run(Pace pace);

 private:
  Pixel classify(int i);
  bool on_floor(int i);
  bool bridged(int i);
  void accept(int i);
  int stride(int i);
  int past_missing(int i);
  void follow_height(int i, float range, float height);
  WalkEnd end_at(BeamCause cause, double beyond);
  WalkEnd end_of_floor();
  void follow(int plane);
  double range_on_floor(double i) const { return samples_.range_on_floor(i); }
  double last_range() const { return last_ >= 0 ? range_on_floor(last_) : 0; }
  double floor_height(double range) const;
  bool in_shadow() const;
  bool faded(double range) const;
  bool faded(double range, double height) const;
  bool falls_away(int i, double beyond) const;
  // Was floor seen without holes up to the last sample?
  bool sharp() const {
    return __builtin_popcount(history_ & ((1U << kSharpWindow) - 1)) >= kSharpFloor;
  }

  const ScanView& view_;
  const WalkLine& line_;
  std::span<const std::uint8_t> labels_;
  WalkPlanes& planes_;
  const ScanOptions& options_;
  LineSamples samples_;
  float noise_px_, per_local_, step_, depth_;

  int plane_ = 0, next_plane_ = 0;
  float offset_ = 0;   // running mean of the height above the plane walked on (m)
  float d_ = 0;        // disparity of the pixel at hand, where it is no plain floor
  int last_ = -1;      // last sample on floor
  int followed_ = -1;  // last sample at which offset_ was brought up to date
  float followed_range_ = 0;
  int above_ = 0, below_ = 0, first_above_ = -1, first_below_ = -1;
  float below_d_ = 0, above_d_ = 0;
  int pending_ = 0, first_pending_ = -1,
      last_pending_ = -1;        // floor seen again behind a gap, not yet believed
  std::array<float, 6> gaps_{};  // ranges of gaps that were bridged
  int bridges_ = 0;
  std::uint32_t history_ = 0;  // one bit a sample up to last_: was it floor?
};

void Walk::follow(int plane) {
  plane_ = plane;
  const WalkPlane& walked = planes_.planes[static_cast<std::size_t>(plane)];
  samples_.follow({walked.disparity, walked.camera_height, noise_px_, step_});
}

double Walk::floor_height(double range) const {
  const Eigen::Vector3d p = planes_.planes[static_cast<std::size_t>(plane_)].body.cast<double>();
  const Eigen::Vector2d xy = view_.t.head<2>() + line_.direction * range;
  return p.x() * xy.x() + p.y() * xy.y() + p.z();
}

// Incidence beyond which the sensor loses floor, or the end of its range, on the plane walked on.
bool Walk::faded(double range) const {
  return faded(range,
               static_cast<double>(planes_.planes[static_cast<std::size_t>(plane_)].camera_height));
}

// Likewise, on a plane that the camera is `height` above.
bool Walk::faded(double range, double height) const {
  return range > height * std::tan(options_.grazing_deg * kDegree) ||
         std::hypot(range, height) > 0.9 * view_.noise.max_range;
}

// What is seen behind the floor lies lower than its end. Where the plane walked on rises over the
// gap, what lies lower than that may be level ground that goes on from the end, or stands on it.
bool Walk::falls_away(int i, double beyond) const {
  if (last_ < 0) return true;
  const double rim = floor_height(last_range());
  const double depth = static_cast<double>(depth_);
  if (floor_height(beyond) - rim <= depth) return true;
  const double u = static_cast<double>(line_.u0 + static_cast<float>(i) * line_.du);
  const double v = static_cast<double>(line_.v0 + static_cast<float>(i) * line_.dv);
  return view_.point(u, v, static_cast<double>(below_d_)).z() < rim - depth;
}

Pixel Walk::classify(int i) {
  samples_.need(i, 1);
  const float tolerance2 = *samples_.tolerance2(i);
  if (!(tolerance2 > 0)) return Pixel::kMissing;
  const float off = *samples_.height(i) - offset_;
  next_plane_ = plane_;
  if (off * off <= tolerance2) return Pixel::kFloor;
  d_ = view_.image->d[samples_.pixel(i)];
  // Another level or ramp, where it meets the surface walked on.
  const int other = labels_.empty() ? -1 : planes_.of_label[labels_[samples_.pixel(i)]];
  if (other >= 0 && other != plane_) {
    const Eigen::Vector3f& q = planes_.planes[static_cast<std::size_t>(other)].body;
    const double range = range_on_floor(last_ >= 0 ? last_ : i);
    const Eigen::Vector2d xy = view_.t.head<2>() + line_.direction * range;
    const double there = q.cast<double>().dot(Eigen::Vector3d(xy.x(), xy.y(), 1));
    if (std::abs(there - floor_height(range)) <= options_.max_step_m + 0.02 * range) {
      next_plane_ = other;
      return Pixel::kFloor;
    }
  }
  if (off > 0) return Pixel::kAbove;
  const float height = planes_.planes[static_cast<std::size_t>(plane_)].camera_height;
  return off < -std::max(noise_px_ * (height / d_), depth_) ? Pixel::kBelow : Pixel::kFloor;
}

// The running mean takes in the height of sample i.
void Walk::follow_height(int i, float range, float height) {
  const float step = followed_ >= 0 ? range - followed_range_ : 0;
  const float share = std::clamp(step * per_local_, 0.05F, 0.5F);
  offset_ += share * (std::clamp(height, -3 * step_, 3 * step_) - offset_);
  followed_ = i;
  followed_range_ = range;
}

// Amid floor: four samples at a time, as long as all of them are floor. They are held against the
// same running mean, which the last of them brings up to date, so that the outcome is that of
// accept() one by one, to the bit. Returns the first sample that is still to be looked at.
int Walk::stride(int i) {
  const int from = i;
  float offset = offset_, before = followed_range_;
  const float most = 3 * step_, per_local = per_local_;
  for (; i + kFollowEvery <= line_.samples; i += kFollowEvery) {
    samples_.need(i, kFollowEvery);
    const Float4 height = load4(samples_.height(i)), tolerance2 = load4(samples_.tolerance2(i));
    const Float4 off = height - offset;
    if (!all4((off * off <= tolerance2) & (tolerance2 > 0.0F))) break;
    const float range = samples_.range(i)[3];
    const float share = std::clamp((range - before) * per_local, 0.05F, 0.5F);
    offset += share * (std::clamp(height[3], -most, most) - offset);
    before = range;
  }
  if (i == from) return i;
  const int count = i - from;
  history_ = (count < 32 ? history_ << count : 0U) | (count < 32 ? (1U << count) - 1 : ~0U);
  offset_ = offset;
  followed_range_ = before;
  followed_ = last_ = i - 1;
  return i;
}

// Missing pixels change nothing: the first sample from i on that may be none of them.
int Walk::past_missing(int i) {
  for (; i + 4 <= line_.samples; i += 4) {
    samples_.need(i, 4);
    if (any4(load4(samples_.tolerance2(i)) > 0.0F)) break;
  }
  return i;
}

// The running mean follows at every fourth sample, and where floor begins anew.
void Walk::accept(int i) {
  if (next_plane_ != plane_) {
    follow(next_plane_);
    offset_ = 0;
    followed_ = -1;
  }
  const int ago = last_ < 0 ? 31 : std::min(31, i - last_);
  if (followed_ < 0 || ago > 1 || i - followed_ >= kFollowEvery) {
    samples_.need(i, 1);
    follow_height(i, *samples_.range(i), *samples_.height(i));
    planes_.planes[static_cast<std::size_t>(plane_)].entered = true;
  }
  history_ = (history_ << ago) | 1U;
  last_ = i;
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
  const double gap = range - last_range();
  if (gap <= options_.max_gap_m) return true;
  return below_ == 0 && faded(last_range()) && gap <= options_.max_faded_gap_m;
}

bool Walk::on_floor(int i) {
  if (last_ >= 0 && i - last_ == 1) {
    accept(i);
    return true;
  }
  // Few pixels of a fading floor believe each other across a short gap only: the foot of a far wall
  // is no floor because a stray pixel before it was.
  const bool apart = pending_ > 0 && i - last_pending_ > options_.min_run_px &&
                     range_on_floor(i) - range_on_floor(last_pending_) > options_.max_gap_m;
  if (apart) pending_ = 0;
  last_pending_ = i;
  if (pending_ == 0) first_pending_ = i;
  if (++pending_ < options_.min_run_px && i - last_ > options_.min_run_px) return true;
  if (!bridged(first_pending_)) return false;
  // Where floor fades there are gaps everywhere: they are no corners.
  if (last_ >= 0 && sharp() && bridges_ < static_cast<int>(gaps_.size())) {
    gaps_[static_cast<std::size_t>(bridges_++)] = static_cast<float>(range_on_floor(last_ + 0.5));
  }
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
  const double floor_d = view_.noise.focal_baseline / std::max(0.1, last_range());
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
  end.plane = plane_;
  end.sample = last_;
  end.history = history_;
  end.bridged = gaps_;
  end.bridges = bridges_;
  if (last_ < 0) {
    end.range = end.gap = cause == BeamCause::kHole ? beyond : 0;
    end.footprint = 0.1 * end.range;
    return end;
  }
  const double next = range_on_floor(last_ + 1);
  end.range = range_on_floor(last_ + 0.5);
  end.footprint = std::max(0.0, next - last_range());
  end.height = static_cast<float>(floor_height(end.range));
  end.gap = std::max(0.0, beyond - end.range);
  end.sharp = sharp();
  return end;
}

// The floor ended and nothing that ends it was seen right behind.
WalkEnd Walk::end_of_floor() {
  WalkEnd end = end_at(BeamCause::kEdgeOfKnowledge, 1e9);
  if (last_ < 0) return end;
  // Floor that leaves the image ends nowhere; stereo has no depth along the sides.
  const bool seen_behind = pending_ > 0 || above_ > 0;
  const int unseen = line_.samples - last_ - 1;
  if (!seen_behind && (line_.exits_side || unseen < 2 * kSharpWindow)) end.sharp = false;
  // At the upper end of a ramp level ground may go on, which is seen at less than the ramp.
  const double level = view_.t.z() - static_cast<double>(end.height);
  end.sharp = end.sharp && !faded(end.range) && !faded(end.range, level);
  end.shadow = end.sharp && in_shadow();
  return end;
}

WalkEnd Walk::run(Pace pace) {
  for (int i = 0; i < line_.samples; ++i) {
    if (pace == Pace::kStrides && last_ == i - 1 && followed_ == last_ && last_ >= 0) {
      i = stride(i);
      if (i >= line_.samples) break;
    }
    const Pixel pixel = classify(i);
    if (pixel == Pixel::kFloor) {
      if (!on_floor(i)) return end_of_floor();
      continue;
    }
    if (pixel == Pixel::kMissing) {
      if (pace == Pace::kStrides) i = past_missing(i + 1) - 1;
      continue;
    }
    pending_ = 0;
    if (pixel == Pixel::kAbove) {
      if (above_++ == 0) {
        first_above_ = i;
        above_d_ = d_;
      }
      if (above_ < options_.min_run_px) continue;
      const double u = static_cast<double>(line_.u0 + static_cast<float>(first_above_) * line_.du);
      const double v = static_cast<double>(line_.v0 + static_cast<float>(first_above_) * line_.dv);
      const double range = (view_.point(u, v, static_cast<double>(above_d_)) - view_.t)
                               .head<2>()
                               .dot(line_.direction);
      if (last_ >= 0 && range - last_range() >
                            options_.max_gap_m + 2 * (range_on_floor(last_ + 1) - last_range()))
        return end_of_floor();
      WalkEnd end = end_at(BeamCause::kObstacle, range);
      end.range = range;
      end.footprint = 0;
      return end;
    }
    if (below_++ == 0) {
      first_below_ = i;
      below_d_ = d_;
    }
    if (below_ < options_.min_run_px) continue;
    const double beyond = range_on_floor(first_below_ - 0.5);
    if (!falls_away(first_below_, beyond)) return end_of_floor();
    WalkEnd end = end_at(BeamCause::kHole, beyond);
    end.beyond = beyond;
    end.beyond_footprint =
        std::max(0.0, range_on_floor(first_below_) - range_on_floor(first_below_ - 1));
    end.faded = last_ >= 0 && !end.sharp;
    return end;
  }
  return last_ < 0 ? WalkEnd() : end_of_floor();
}

}  // namespace

WalkEnd walk(const ScanView& view, const WalkLine& line, std::span<const std::uint8_t> labels,
             WalkPlanes& planes, const ScanOptions& options, Pace pace) {
  if (planes.planes.empty()) return {};
  return Walk(view, line, labels, planes, options).run(pace);
}

}  // namespace lamina
