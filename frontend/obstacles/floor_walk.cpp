// One state machine a line; all thresholds in disparity, where noise is constant.
#include <lamina/frontend/obstacles/floor_walk.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/floor/lanes.hpp>

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
        direction_(std::cos(line.azimuth), std::sin(line.azimuth)),
        noise_px_(
            static_cast<float>(options.noise_sigmas *
                               std::hypot(view.noise.disparity_sigma, view.noise.disparity_floor))),
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
  void follow_height(int i, double step);
  WalkEnd end_at(BeamCause cause, double beyond);
  WalkEnd end_of_floor();
  void follow(int plane);
  double range_on_floor(double i) const;
  double last_range() const { return last_ >= 0 ? range_on_floor(last_) : 0; }
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
  // Of the plane walked on: disparity from the principal point, and metres to pixels.
  Eigen::Vector3f expected_ = Eigen::Vector3f::Zero();
  float per_height_ = 0;
  double disparity0_ = 0, disparity_step_ = 0, outward0_ = 0, outward_step_ = 0;
  float offset_ = 0;    // running mean of the height above the plane (m)
  float above_px_ = 0;  // of the pixel at hand above the plane walked on (px)
  float d_ = 0;         // its disparity
  int last_ = -1;       // last sample on floor
  int followed_ = -1;   // last sample at which offset_ was brought up to date
  double followed_range_ = 0;
  int above_ = 0, below_ = 0, first_above_ = -1, first_below_ = -1;
  float below_d_ = 0, above_d_ = 0;
  int pending_ = 0, first_pending_ = -1,
      last_pending_ = -1;        // floor seen again behind a gap, not yet believed
  std::array<float, 6> gaps_{};  // ranges of gaps that were bridged
  int bridges_ = 0;
  std::uint32_t history_ = 0;  // one bit a sample up to last_: was it floor?
};

// Along a line the floor's disparity and the ray's outward part both change linearly.
void Walk::follow(int plane) {
  plane_ = plane;
  WalkPlane& walked = planes_.planes[static_cast<std::size_t>(plane)];
  expected_ = walked.disparity;
  per_height_ = 1 / walked.camera_height;
  const Eigen::Vector3d p = walked.disparity.cast<double>();
  const double u = static_cast<double>(line_.u0), v = static_cast<double>(line_.v0);
  const double du = static_cast<double>(line_.du), dv = static_cast<double>(line_.dv);
  disparity0_ = p.dot(Eigen::Vector3d(u - view_.cx, v - view_.cy, 1));
  disparity_step_ = p.x() * du + p.y() * dv;
  outward0_ = view_.ray(u, v).head<2>().dot(direction_);
  outward_step_ = view_.ray(u + du, v + dv).head<2>().dot(direction_) - outward0_;
}

// Horizontal distance from the camera's foot at which sample i's ray meets the floor walked on.
double Walk::range_on_floor(double i) const {
  const double d = disparity0_ + i * disparity_step_;
  return d > 1e-9 ? view_.noise.focal_baseline / d * (outward0_ + i * outward_step_) : 1e9;
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
  // Above the plane by height: d - expected = height d / camera_height.
  const float px_per_m = d_ * per_height_;
  above_px_ = d_ - (expected_.x() * fu + expected_.y() * fv + expected_.z());
  const float off = above_px_ - offset_ * px_per_m;
  next_plane_ = plane_;
  if (std::abs(off) <= std::max(noise_px_, step_ * px_per_m)) return Pixel::kFloor;
  // Another level or ramp, where it meets the surface walked on.
  const int other = labels_.empty() ? -1 : planes_.of_label[labels_[at]];
  if (other >= 0 && other != plane_) {
    const Eigen::Vector3f& q = planes_.planes[static_cast<std::size_t>(other)].body;
    const double range = range_on_floor(last_ >= 0 ? last_ : i);
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

// The running mean takes in sample i, `step` metres after the one before.
void Walk::follow_height(int i, double step) {
  const float share = static_cast<float>(std::clamp(step / options_.local_floor_m, 0.05, 0.5));
  const float height = above_px_ / (d_ * per_height_);
  offset_ += share * (std::clamp(height, -3 * step_, 3 * step_) - offset_);
  followed_ = i;
}

// Amid floor: four samples at a time, as long as all of them are floor. They are held against the
// same running mean, which the last of them brings up to date, so that the outcome is that of
// accept() one by one, to the bit. Returns the first sample that is still to be looked at.
int Walk::stride(int i) {
  const int width = view_.image->width;
  const float* image = view_.image->d.data();
  const float cx = static_cast<float>(view_.cx), cy = static_cast<float>(view_.cy);
  constexpr Float4 kSteps = {0, 1, 2, 3};
  while (i == followed_ + 1 && i + kFollowEvery <= line_.samples) {
    const Float4 at = static_cast<float>(i) + kSteps;
    const Int4 pu = __builtin_convertvector(line_.u0 + at * line_.du + 0.5F, Int4);
    const Int4 pv = __builtin_convertvector(line_.v0 + at * line_.dv + 0.5F, Int4);
    const Float4 d = {image[pv[0] * width + pu[0]], image[pv[1] * width + pu[1]],
                      image[pv[2] * width + pu[2]], image[pv[3] * width + pu[3]]};
    const Float4 fu = __builtin_convertvector(pu, Float4) - cx;
    const Float4 fv = __builtin_convertvector(pv, Float4) - cy;
    const Float4 px_per_m = d * per_height_;
    const Float4 above = d - (expected_.x() * fu + expected_.y() * fv + expected_.z());
    const Float4 off = above - offset_ * px_per_m;
    const Float4 scaled = step_ * px_per_m;
    const Float4 tolerance = scaled > noise_px_ ? scaled : noise_px_ + Float4{};
    const Int4 floor = (d > 0.0F) & (off <= tolerance) & (-off <= tolerance);
    if ((floor[0] & floor[1] & floor[2] & floor[3]) == 0) return i;
    i += kFollowEvery;
    history_ = (history_ << kFollowEvery) | ((1U << kFollowEvery) - 1);
    last_ = i - 1;
    above_px_ = above[3];
    d_ = d[3];
    const double range = range_on_floor(last_);
    follow_height(last_, range - followed_range_);
    followed_range_ = range;
  }
  return i;
}

// The running mean follows at every fourth sample, and where floor begins anew.
void Walk::accept(int i) {
  if (next_plane_ != plane_) {
    follow(next_plane_);
    offset_ = above_px_ = 0;
    followed_ = -1;
  }
  const int ago = last_ < 0 ? 31 : std::min(31, i - last_);
  if (followed_ < 0 || ago > 1 || i - followed_ >= kFollowEvery) {
    const double range = range_on_floor(i);
    follow_height(i, followed_ >= 0 ? range - followed_range_ : 0);
    planes_.planes[static_cast<std::size_t>(plane_)].entered = true;
    followed_range_ = range;
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
  if (last_ >= 0 && bridges_ < static_cast<int>(gaps_.size())) {
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
  end.footprint = next - last_range();
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
  // Floor that leaves the image ends nowhere; stereo has no depth along the sides.
  const bool seen_behind = pending_ > 0 || above_ > 0;
  const int unseen = line_.samples - last_ - 1;
  if (!seen_behind && (line_.exits_side || unseen < 2 * kSharpWindow)) end.sharp = false;
  end.sharp = end.sharp && !faded(end.range);
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
    WalkEnd end = end_at(BeamCause::kHole, beyond);
    end.beyond = beyond;
    end.beyond_footprint = range_on_floor(first_below_) - range_on_floor(first_below_ - 1);
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
