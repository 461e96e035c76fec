// Rims that go on where only a little shows: hysteresis along the image.
#include <algorithm>
#include <cmath>

#include <lamina/frontend/obstacles/floor_walk.hpp>

namespace lamina {
namespace {

// Samples of floor before the rim, of ground behind it; and how many of them must have been
// measured.
constexpr int kBefore = 16, kShort = 3, kBehind = 5, kMeasuredBefore = 4, kMeasuredBehind = 2;
constexpr float kSigmas = 3.5F, kSame = 2;
constexpr float kLateral = 0.5F;  // px [Barron2013]

// Residuals of one line's pixels against a floor (px of disparity; NaN: missing).
class Profile {
 public:
  Profile(const ScanView& view, const WalkLine& line, const WalkPlane& plane)
      : view_(view), line_(line), plane_(plane) {
    const double u = static_cast<double>(line.u0), v = static_cast<double>(line.v0);
    outward0_ = view.ray(u, v).head<2>().dot(line.direction);
    outward_step_ = view.ray(u + static_cast<double>(line.du), v + static_cast<double>(line.dv))
                        .head<2>()
                        .dot(line.direction) -
                    outward0_;
  }

  double range(double i) const {
    const double d = static_cast<double>(expected(static_cast<float>(i)));
    return d > 1e-9 ? view_.noise.focal_baseline / d * (outward0_ + i * outward_step_) : 1e9;
  }
  /// First sample beyond a range: ranges grow along the line.
  int sample_at(double range_m) const {
    int low = 0, high = line_.samples;
    while (low < high) {
      const int middle = (low + high) / 2;
      if (range(middle) < range_m) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }
  /// Is there floor from sample i on: most of the next were seen, and lie as high as those before?
  bool is_floor(int i) const {
    float behind = 0;
    int m = 0;
    for (int k = i; k < i + kBehind; ++k) add(k, behind, m);
    return 2 * m > kBehind && std::abs(drop(i, kBehind)) < kSame;
  }
  /// How far the mean of `count` samples from `i` on lies below the `kBefore` before it, in
  /// sigmas; 0 where too little was seen.
  float drop(int i, int count) const {
    float before = 0, behind = 0;
    int n = 0, m = 0;
    for (int k = i - kBefore; k < i; ++k) add(k, before, n);
    for (int k = i; k < i + count; ++k) add(k, behind, m);
    if (n < kMeasuredBefore || m < kMeasuredBehind) return 0;
    // Neighbours along the line share their noise: three of them are one.
    const float own = static_cast<float>(view_.noise.disparity_sigma);
    const float slope = plane_.disparity.x() * line_.du + plane_.disparity.y() * line_.dv;
    const float aside = kLateral * slope;
    const float variance = own * own + aside * aside / static_cast<float>(m);
    return (before / static_cast<float>(n) - behind / static_cast<float>(m)) / std::sqrt(variance);
  }

 private:
  float expected(float i) const {
    const float u = line_.u0 + i * line_.du - static_cast<float>(view_.cx);
    const float v = line_.v0 + i * line_.dv - static_cast<float>(view_.cy);
    return plane_.disparity.x() * u + plane_.disparity.y() * v + plane_.disparity.z();
  }
  void add(int i, float& sum, int& n) const {
    if (i < 0 || i >= line_.samples) return;
    const float fi = static_cast<float>(i);
    const int u = static_cast<int>(line_.u0 + fi * line_.du + 0.5F);
    const int v = static_cast<int>(line_.v0 + fi * line_.dv + 0.5F);
    const float d = view_.image->row(v)[u];
    if (!(d > 0)) return;
    const float fu = static_cast<float>(u) - static_cast<float>(view_.cx);
    const float fv = static_cast<float>(v) - static_cast<float>(view_.cy);
    sum += d - (plane_.disparity.x() * fu + plane_.disparity.y() * fv + plane_.disparity.z());
    ++n;
  }

  const ScanView& view_;
  const WalkLine& line_;
  const WalkPlane& plane_;
  double outward0_ = 0, outward_step_ = 0;
};

// The straight line through the last ends of a rim: 1 / range = a cos + b sin of the azimuth.
class StraightRim {
 public:
  void add(double azimuth, double range) {
    constexpr double kForget = 0.97;  // a line: some thirty lines count
    const double c = std::cos(azimuth), s = std::sin(azimuth), y = 1 / range;
    for (double* sum : {&cc_, &cs_, &ss_, &cy_, &sy_, &n_}) *sum *= kForget;
    cc_ += c * c, cs_ += c * s, ss_ += s * s, cy_ += c * y, sy_ += s * y, n_ += 1;
  }
  /// 0 where too few lines say where it goes.
  double range(double azimuth) const {
    const double det = cc_ * ss_ - cs_ * cs_;
    if (n_ < 8 || !(det > 0)) return 0;
    const double a = (cy_ * ss_ - sy_ * cs_) / det, b = (sy_ * cc_ - cy_ * cs_) / det;
    const double y = a * std::cos(azimuth) + b * std::sin(azimuth);
    return y > 1e-3 ? 1 / y : 0;
  }

 private:
  double cc_ = 0, cs_ = 0, ss_ = 0, cy_ = 0, sy_ = 0, n_ = 0;
};

// A rim on its way over the neighbouring lines.
struct Rim {
  WalkEnd end;  // of the last line that has it
  StraightRim straight;
  double step = 0;  // m its range changes from line to line
  int firm = 0;     // lines it was seen on
  int on = -1;      // lines it may still go on unseen, -1: any number
  int skipped = 0;  // lines since then that ended before it
  bool known = false;

  double expected(double azimuth) const {
    const double range = skipped > 0 ? straight.range(azimuth) : 0;
    return range > 0 ? range : end.range + step;
  }
};

// A rim goes on behind a post; not behind a cupboard.
constexpr double kPost = 0.12;  // m
// Lines that can neither show a rim nor floor where it would be end there, as far as this.
constexpr double kUncertified = 0.3;  // m

void take(const Rim& rim, double range, BeamCause cause, WalkEnd& to) {
  to.cause = cause;
  to.range = range;
  to.footprint = rim.end.footprint;
  to.height = rim.end.height;
  to.plane = rim.end.plane;
}

// Tries to carry the rim on to the line of `to`.
bool carry(const Profile& profile, const Rim& rim, double expected, WalkEnd& to) {
  const int middle = profile.sample_at(expected);
  int best = -1;
  float most = kSigmas;
  for (const int behind : {kShort, kBehind}) {
    for (int i = middle - 2; i <= middle + 2; ++i) {
      const float drop = profile.drop(i, behind);
      if (drop > most) {
        most = drop;
        best = i;
      }
    }
  }
  if (best < 0) return false;
  take(rim, profile.range(best - 0.5), rim.end.cause, to);
  to.footprint = profile.range(best) - profile.range(best - 1);
  to.sample = best - 1;
  to.faded = rim.end.faded;
  return true;
}

// A rim's end is known to half a footprint like the rim itself: over that much more it is taken to
// go on straight. Only from rims of several lines.
constexpr int kFirm = 8;

int lines_of_half_a_footprint(const WalkEnd& end, double line_step) {
  return static_cast<int>(0.5 * end.footprint / std::max(1e-6, end.range * line_step));
}

// One way along the image, from each rim over the lines beside it.
class Growth {
 public:
  Growth(const ScanView& view, const std::vector<WalkLine>& lines, const WalkPlanes& planes)
      : view_(view),
        lines_(lines),
        planes_(planes),
        line_step_(std::abs(lines[1].azimuth - lines[0].azimuth)) {}

  void visit(std::size_t j, WalkEnd& end) {
    const double azimuth = lines_[j].azimuth;
    if (is_negative(end.cause) && end.sample >= 0) return meet(azimuth, end);
    if (!rim_.known) return;
    const double expected = rim_.expected(azimuth);
    const bool before = end.range < expected - 3 * rim_.end.footprint;
    if (end.sample < 0 || lines_[j].samples == 0 || before) return skip(kPost);
    const WalkPlane& plane = planes_.planes[static_cast<std::size_t>(rim_.end.plane)];
    const Profile profile(view_, lines_[j], plane);
    if (rim_.on < 0 && carry(profile, rim_, expected, end)) return meet(azimuth, end);
    if (rim_.on < 0) rim_.on = may_go_on() ? lines_of_half_a_footprint(rim_.end, line_step_) : 0;
    if (rim_.on > 0) {
      const int on = rim_.on - 1;
      take(rim_, expected, rim_.end.cause, end);
      meet(azimuth, end);
      rim_.on = on;
      return;
    }
    // Nothing more says that it goes on. Where nothing says that it does not, nobody knows.
    if (profile.is_floor(profile.sample_at(expected) + 1)) {
      rim_ = Rim();
      return;
    }
    take(rim_, expected, BeamCause::kEdgeOfKnowledge, end);
    end.barred = true;
    skip(kUncertified);
  }

 private:
  bool may_go_on() const { return rim_.firm >= kFirm && rim_.skipped == 0; }
  void meet(double azimuth, const WalkEnd& end) {
    const double step = end.range - rim_.end.range;
    const bool straight = rim_.known && std::abs(step) < 2 * end.footprint;
    const bool apart =
        rim_.known && std::abs(end.range - rim_.expected(azimuth)) > 4 * end.footprint;
    StraightRim all = apart || !rim_.known ? StraightRim() : rim_.straight;
    all.add(azimuth, end.range);
    const bool goes_on = rim_.known && rim_.skipped == 0;
    rim_ = {end, all, straight && goes_on ? step : 0, goes_on ? rim_.firm + 1 : 1, -1, 0, true};
  }
  void skip(double most) {
    if (++rim_.skipped * line_step_ * rim_.end.range > most) rim_ = Rim();
  }

  const ScanView& view_;
  const std::vector<WalkLine>& lines_;
  const WalkPlanes& planes_;
  double line_step_;
  Rim rim_;
};

// Holes narrower than any wheel are specks of the matcher, unless the image's border cuts them.
constexpr double kNarrowest = 0.03;  // m

void drop_narrow(double line_step, std::vector<WalkEnd>& ends) {
  const std::size_t n = ends.size();
  for (std::size_t j = 0, k = 0; j < n; j = std::max(k, j + 1)) {
    double width = 0;
    for (k = j; k < n && is_negative(ends[k].cause); ++k) width += ends[k].range * line_step;
    if (k == j || j == 0 || k == n || width >= kNarrowest) continue;
    for (std::size_t i = j; i < k; ++i) ends[i].cause = BeamCause::kEdgeOfKnowledge;
  }
}

}  // namespace

void grow_rims(const ScanView& view, const std::vector<WalkLine>& lines, const WalkPlanes& planes,
               std::vector<WalkEnd>& ends) {
  if (ends.size() < 2) return;
  Growth there(view, lines, planes), back(view, lines, planes);
  for (std::size_t j = 0; j < ends.size(); ++j) there.visit(j, ends[j]);
  for (std::size_t j = ends.size(); j-- > 0;) back.visit(j, ends[j]);
  drop_narrow(std::abs(lines[1].azimuth - lines[0].azimuth), ends);
}

}  // namespace lamina
