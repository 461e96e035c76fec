// Rims that go on where only a little shows: hysteresis along the image.
#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/frontend/obstacles/floor_walk.hpp>
#include <lamina/frontend/obstacles/rim_profile.hpp>
#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

// The straight line through the last ends of a rim: 1 / range = a cos + b sin of the azimuth.
class StraightRim {
 public:
  void add(double azimuth, double range) {
    constexpr double kForget = 0.97;  // a line: some thirty lines count
    const double c = std::cos(azimuth), s = std::sin(azimuth), y = 1 / range;
    for (double* sum : {&cc_, &cs_, &ss_, &cy_, &sy_, &n_}) *sum *= kForget;
    cc_ += c * c, cs_ += c * s, ss_ += s * s, cy_ += c * y, sy_ += s * y, n_ += 1;
  }
  bool known() const { return n_ >= 8; }
  /// 0 where too few lines say where it goes.
  double range(double azimuth) const {
    const double det = cc_ * ss_ - cs_ * cs_;
    if (!known() || !(det > 0)) return 0;
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
  double gap = 0;   // m of unseen ground behind it, of the last line that saw below
  int firm = 0;     // lines it was seen on
  int on = -1;      // lines it may still go on unseen, -1: any number
  int skipped = 0;  // lines since then that ended before it
  bool known = false;

  /// Between the last floor and the first ground seen below lies the rim.
  double reach(const RimProfile& profile, double from) const {
    constexpr int kFarthest = 8;  // samples
    return std::min(from + gap, profile.range(profile.sample_at(from) + kFarthest));
  }
  /// `aside`: m since the last line that has it. Ends scatter where floor fades: no line through
  /// them leads farther off than a rim as oblique as kSteepest would.
  double expected(double azimuth, double aside) const {
    return skipped > 0 ? straight_on(azimuth, aside) : one_step_on();
  }
  double straight_on(double azimuth, double aside) const {
    constexpr double kSteepest = 2;  // m of range a metre aside
    const double range = straight.range(azimuth);
    if (!(range > 0)) return one_step_on();
    const double most = 3 * end.footprint + kSteepest * aside;
    return std::clamp(range, std::max(nearest(), end.range - most), end.range + most);
  }

 private:
  /// From one line to the next a rim comes no nearer than by half: ranges stay above zero.
  double nearest() const { return 0.5 * end.range; }
  double one_step_on() const { return std::max(nearest(), end.range + step); }
};

// A rim goes on behind a post; not behind a cupboard.
constexpr double kPost = 0.12;  // m
// Lines that can neither show a rim nor floor where it would be end there, as far as this.
constexpr double kUncertified = 0.3;  // m

void take(const Rim& rim, double range, BeamCause cause, WalkEnd& to) {
  to.cause = cause;
  to.range = range;
  to.footprint = rim.end.footprint;
  to.unseen = rim.end.unseen;
  to.height = rim.end.height;
  to.plane = rim.end.plane;
}

// Tries to carry the rim on to the line of `to`.
bool carry(const RimProfile& profile, const Rim& rim, double expected, WalkEnd& to) {
  const int first = profile.sample_at(expected) - 2;
  const int last = profile.sample_at(rim.reach(profile, expected)) + 2;
  int best = -1;
  float most = RimProfile::kSigmas;
  for (const int behind : {RimProfile::kShort, RimProfile::kBehind}) {
    for (int i = first; i <= last; ++i) {
      const float drop = profile.drop(i, behind);
      if (drop > most) {
        most = drop;
        best = i;
      }
    }
  }
  if (best < 0) return false;
  // It ends the floor that this line has before it: the side of a ramp goes on from the ramp.
  const int floor = profile.floor_before(best);
  const RimProfile ended = profile.on(floor);
  take(rim, ended.range(best - 0.5), rim.end.cause, to);
  to.plane = floor;
  to.height = ended.height(to.range);
  to.footprint = std::max(0.0, ended.range(best) - ended.range(best - 1));
  to.sample = best - 1;
  to.unseen = ended.unseen(best);
  to.faded = rim.end.faded;
  return true;
}

// A rim's end is known to half a footprint like the rim itself: over that much more it is taken to
// go on straight. Only from rims of several lines.
constexpr int kFirm = 8;

int lines_of_half_a_footprint(const WalkEnd& end, double line_step) {
  constexpr int kMost = 64;  // lines
  return to_whole(0.5 * end.footprint / std::max(1e-6, end.range * line_step), 0, kMost);
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
    const double aside = (rim_.skipped + 1) * line_step_ * rim_.end.range;
    const double expected = rim_.expected(azimuth, aside);
    // A post at the rim is before it, too.
    const bool post = end.cause == BeamCause::kObstacle && end.range < expected + rim_.gap;
    const bool before = post || end.range < expected - 3 * rim_.end.footprint;
    if (end.sample < 0 || lines_[j].samples == 0 || before) return skip(kPost);
    const RimProfile profile(view_, lines_[j], planes_, rim_.end.plane);
    const bool may_be_hidden = rim_.straight.known() && aside <= profile.hidden_way(expected);
    if (rim_.on < 0 && carry(profile, rim_, expected, end)) return meet(azimuth, end);
    if (rim_.on < 0) rim_.on = may_go_on() ? lines_of_half_a_footprint(rim_.end, line_step_) : 0;
    if (rim_.on > 0) {
      const int on = rim_.on - 1;
      take(rim_, rim_.straight_on(azimuth, aside), rim_.end.cause, end);
      meet(azimuth, end);
      rim_.on = on;
      return;
    }
    // After a line that showed nothing, what looks like the rim says where it may go on, no more.
    if (may_be_hidden && carry(profile, rim_, expected, end)) {
      meet(azimuth, end);
      rim_.on = 0;
      end.cause = BeamCause::kEdgeOfKnowledge;
      end.barred = true;
      return;
    }
    // Nothing more says that it goes on. Where nothing says that it does not, nobody knows.
    const int behind = profile.sample_at(rim_.reach(profile, expected)) + 1;
    if (!may_be_hidden && profile.is_floor(behind)) {
      rim_ = Rim();
      return;
    }
    const bool lost = end.cause == BeamCause::kEdgeOfKnowledge;
    take(rim_, lost ? std::min(end.range, expected) : expected, BeamCause::kEdgeOfKnowledge, end);
    end.barred = true;
    skip(kUncertified);
  }

 private:
  bool may_go_on() const { return rim_.firm >= kFirm && rim_.skipped == 0; }
  void meet(double azimuth, const WalkEnd& end) {
    const double step = end.range - rim_.end.range;
    const bool straight = rim_.known && std::abs(step) < 2 * end.footprint;
    const bool apart =
        rim_.known && std::abs(end.range - rim_.expected(azimuth, 0)) > 4 * end.footprint;
    StraightRim all = apart || !rim_.known ? StraightRim() : rim_.straight;
    all.add(azimuth, end.range);
    const bool goes_on = rim_.known && rim_.skipped == 0;
    const double gap =
        end.beyond > 0 ? std::max(0.0, end.beyond - end.range) : (rim_.known ? rim_.gap : 0);
    rim_ = {end, all, straight && goes_on ? step : 0, gap, goes_on ? rim_.firm + 1 : 1, -1,
            0,   true};
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

// Lines between two ends of one rim, not farther apart than a post is wide, that lost the floor
// before it: the rim goes straight on there. Only of rims that kFirm lines to each side show.
void fill_rims(double line_step, std::vector<WalkEnd>& ends) {
  const auto firm = [&](std::size_t j, int way) {
    int seen = 0;
    for (int k = 0; k < 2 * kFirm; ++k) {
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(j) + way * k;
      if (at < 0 || at >= static_cast<std::ptrdiff_t>(ends.size())) break;
      const WalkEnd& e = ends[static_cast<std::size_t>(at)];
      seen += is_negative(e.cause) && std::abs(e.range - ends[j].range) < 6 * e.footprint;
    }
    return seen >= kFirm;
  };
  std::size_t last = ends.size();  // the rim's last line so far
  for (std::size_t j = 0; j < ends.size(); ++j) {
    const bool rim = is_negative(ends[j].cause) && ends[j].sample >= 0;
    const bool lost = ends[j].cause == BeamCause::kEdgeOfKnowledge && ends[j].sample >= 0;
    if (!rim && !lost) last = ends.size();
    if (!rim) continue;
    const std::size_t from = std::exchange(last, j);
    if (from >= j || j - from < 2) continue;
    const WalkEnd a = ends[from], b = ends[j];
    const double n = static_cast<double>(j - from), most = std::max(a.footprint, b.footprint);
    if (n * line_step * b.range > kPost || std::abs(b.range - a.range) > 4 * most) continue;
    if (!firm(from, -1) || !firm(j, 1)) continue;
    for (std::size_t k = from + 1; k < j; ++k) {
      const double range = a.range + (b.range - a.range) * static_cast<double>(k - from) / n;
      if (ends[k].range > range + 2 * most) continue;
      const Rim rim_here{a, {}, 0, 0, 0, -1, 0, true};
      take(rim_here, range, a.cause, ends[k]);
    }
  }
}

// Holes narrower than any wheel are specks of the matcher, unless the image's border cuts them.
// Where another rim is as near as a post is wide, something hides the rest: nobody knows.
constexpr double kNarrowest = 0.03;  // m

void drop_narrow(double line_step, std::vector<WalkEnd>& ends) {
  const std::vector<WalkEnd> raw = ends;
  const std::size_t n = raw.size();
  for (std::size_t j = 0, k = 0; j < n; j = std::max(k, j + 1)) {
    double width = 0;
    for (k = j; k < n && is_negative(raw[k].cause); ++k) width += raw[k].range * line_step;
    if (k == j || j == 0 || k == n || width >= kNarrowest) continue;
    const std::size_t reach = to_index(kPost / (raw[j].range * line_step + 1e-9), n);
    bool another = false;
    for (std::size_t i = 1; i <= reach; ++i) {
      another |= i <= j && is_negative(raw[j - i].cause);
      another |= k + i < n && is_negative(raw[k + i].cause);
    }
    for (std::size_t i = j; i < k; ++i) {
      ends[i].cause = BeamCause::kEdgeOfKnowledge;
      ends[i].barred |= another;
    }
  }
}

}  // namespace

void grow_rims(const ScanView& view, const std::vector<WalkLine>& lines, const WalkPlanes& planes,
               std::vector<WalkEnd>& ends) {
  if (ends.size() < 2) return;
  Growth there(view, lines, planes), back(view, lines, planes);
  for (std::size_t j = 0; j < ends.size(); ++j) there.visit(j, ends[j]);
  for (std::size_t j = ends.size(); j-- > 0;) back.visit(j, ends[j]);
  fill_rims(std::abs(lines[1].azimuth - lines[0].azimuth), ends);
  drop_narrow(std::abs(lines[1].azimuth - lines[0].azimuth), ends);
}

}  // namespace lamina
