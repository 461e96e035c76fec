// Split-and-merge on least-squares costs.
#include <lamina/frontend/segments/segment_extractor.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {
// Places tried evenly along a run before the best is refined by halving steps.
constexpr int kSplitCandidates = 16;
// The scatter that the returns of two lines leave raises the bar of a merge up to this.
constexpr double kMaxScatter = 3;
// How far behind a line a return must lie to prove an opening (m, and sigmas).
constexpr double kOpening = 0.05, kOpeningSigmas = 4;
// Chord against beam where consecutive beams may still be joined if they prove collinear (rad).
constexpr double kGrazing = 0.05;
}  // namespace

SegmentExtractor::SegmentExtractor(SegmentOptions options) : options_(options) {
  const std::vector<std::string> problems = options_.problems();
  if (!problems.empty()) throw Error(problems.front());
}

Segments SegmentExtractor::extract(const LaserScan& scan) {
  Segments out;
  out.missing = points_.load(scan, options_);
  out.noise_scale = points_.noise_scale();
  increment_ = std::abs(scan.angle_increment);
  const double ratio = scan.lidar.noise.range_floor / points_.sigma_r();
  floor_ratio_ = ratio * ratio;
  runs_.clear();
  used_.assign(static_cast<std::size_t>(points_.size()), 0);
  for (int begin = 0, i = 1; i <= points_.size(); ++i) {
    if (i < points_.size() && !points_.breaks_before(i)) continue;
    split(begin, i);
    begin = i;
  }
  merge_neighbours();
  merge_seam();
  drop_curved(out);
  drop_debris();
  refine_boundaries();
  bridge();
  for (const Run& run : runs_) emit(run, out);
  for (int i = 0; i < points_.size(); ++i) {
    if (!used_[static_cast<std::size_t>(i)]) out.loose_beams.push_back(points_.beam(i));
  }
  std::sort(out.segments.begin(), out.segments.end(),
            [](const auto& a, const auto& b) { return a.first_beam < b.first_beam; });
  return out;
}

// What all returns share (range_floor) does not average over a run: long runs must show more.
double SegmentExtractor::threshold(int count) const {
  return options_.split_gain * (1 + 0.25 * count * floor_ratio_);
}

// `before` and `after`: what else belongs to the two sides.
int SegmentExtractor::best_split(int begin, int end, const InverseRangeSums& before,
                                 const InverseRangeSums& after, double& gain) const {
  const int n = end - begin;
  const auto cost = [&](int k) {
    return (before + points_.sums(begin, k)).cost() + (points_.sums(k, end) + after).cost();
  };
  int stride = std::max(1, n / kSplitCandidates);
  int best = begin + 1;
  double best_cost = cost(best);
  const auto consider = [&](int k) {
    if (k <= begin || k >= end) return;
    const double value = cost(k);
    if (value < best_cost) {
      best_cost = value;
      best = k;
    }
  };
  for (int k = begin + stride; k < end; k += stride) consider(k);
  consider(end - 1);
  for (stride /= 2; stride >= 1; stride /= 2) {
    const int centre = best;
    consider(centre - stride);
    consider(centre + stride);
  }
  gain = (before + points_.sums(begin, end) + after).cost() - best_cost;
  return best;
}

void SegmentExtractor::split(int begin, int end) {
  if (end - begin >= 4) {
    double gain = 0;
    const int k = best_split(begin, end, {}, {}, gain);
    if (gain > threshold(end - begin)) {
      split(begin, k);
      split(k, end);
      return;
    }
  }
  Run run;
  run.parts = {{begin, end}};
  run.sums = points_.sums(begin, end);
  runs_.push_back(std::move(run));
}

// Positive when one line for both loses significantly; where even two lines fit worse than the
// noise model says, by the scatter they leave.
double SegmentExtractor::merge_loss(const Run& a, const Run& b) const {
  const InverseRangeSums both = a.sums + b.sums;
  const double apart = a.sums.cost() + b.sums.cost();
  const double reduced = both.count > 8 ? apart / (both.count - 4) : 1.0;
  return both.cost() - apart - threshold(both.count) * std::clamp(reduced, 1.0, kMaxScatter);
}

bool SegmentExtractor::contiguous(const Run& a, const Run& b) const {
  return a.end() == b.begin() && !points_.breaks_before(b.begin());
}

void SegmentExtractor::append(Run& a, const Run& b) {
  a.sums = a.sums + b.sums;
  a.uncertain_end = b.uncertain_end;
  for (const auto& part : b.parts) {
    if (part.first == a.end()) {
      a.parts.back().second = part.second;
    } else {
      a.parts.push_back(part);
    }
  }
}

// Passes over the runs; in each a pair is merged when it loses least among its neighbours.
void SegmentExtractor::merge_neighbours() {
  for (bool merged = true; merged;) {
    merged = false;
    std::size_t kept = 0;
    double previous = 1;
    for (std::size_t i = 1; i < runs_.size(); ++i) {
      Run& a = runs_[kept];
      const double loss = contiguous(a, runs_[i]) ? merge_loss(a, runs_[i]) : 1.0;
      const bool later_is_better = i + 1 < runs_.size() && contiguous(runs_[i], runs_[i + 1]) &&
                                   merge_loss(runs_[i], runs_[i + 1]) < loss;
      if (loss < 0 && loss <= previous && !later_is_better) {
        append(a, runs_[i]);
        merged = true;
        previous = 1;
      } else {
        previous = loss;
        if (++kept != i) runs_[kept] = std::move(runs_[i]);
      }
    }
    if (!runs_.empty()) runs_.resize(kept + 1);
  }
}

void SegmentExtractor::merge_seam() {
  if (!points_.full_circle() || runs_.size() < 2) return;
  const Run& last = runs_.back();
  if (merge_loss(last, runs_.front()) >= 0 || !can_bridge(last, runs_.front())) return;
  Run joined = runs_.back();
  append(joined, runs_.front());
  runs_.pop_back();
  runs_.front() = std::move(joined);
}

void SegmentExtractor::drop_debris() {
  std::erase_if(runs_, [&](const Run& run) { return run.sums.count < options_.min_points; });
}

void SegmentExtractor::refine_boundaries() {
  for (std::size_t i = 1; i < runs_.size(); ++i) {
    Run &a = runs_[i - 1], &b = runs_[i];
    if (!contiguous(a, b)) continue;
    refine_boundary(a, b);
    if (!meet_at_corner(a, b)) uncertain_boundary(a, b);
  }
}

// The sums of two contiguous runs with the returns from k on in the second.
SegmentExtractor::Sides SegmentExtractor::divided_at(const Run& a, const Run& b, int k) const {
  const int start = b.begin();
  if (k >= start) {
    const InverseRangeSums moved = points_.sums(start, k);
    return {a.sums + moved, b.sums - moved};
  }
  const InverseRangeSums moved = points_.sums(k, start);
  return {a.sums - moved, b.sums + moved};
}

void SegmentExtractor::divide_at(Run& a, Run& b, int k) const {
  const Sides sides = divided_at(a, b, k);
  a.sums = sides.a;
  b.sums = sides.b;
  a.parts.back().second = b.parts.front().first = k;
}

// Moves the boundary between two lines to where it costs least.
void SegmentExtractor::refine_boundary(Run& a, Run& b) const {
  const int low = lowest_boundary(a), high = highest_boundary(b);
  int best = b.begin();
  double best_cost = a.sums.cost() + b.sums.cost();
  for (int stride = 8; stride >= 1; stride /= 2) {
    const int centre = best;
    for (const int k : {centre - stride, centre + stride}) {
      if (k < low || k > high) continue;
      const double value = divided_at(a, b, k).cost();
      if (value >= best_cost) continue;
      best_cost = value;
      best = k;
    }
  }
  divide_at(a, b, best);
}

// Where the cost is least each return near the corner is on the line that its own noise is nearer
// to, and the line turns towards it: by a quarter of its sigma, the same in every scan. Surfaces
// that go on into each other change where their lines meet, which single returns hardly move.
bool SegmentExtractor::meet_at_corner(Run& a, Run& b) const {
  const int low = lowest_boundary(a), high = highest_boundary(b);
  const double least = a.sums.cost() + b.sums.cost();
  bool meets = false;
  for (int pass = 0; pass < 2; ++pass) {
    double A = 0, B = 0, other_A = 0, other_B = 0;
    if (!a.sums.solve(A, B) || !b.sums.solve(other_A, other_B)) return meets;
    const auto first_is_nearer = [&](int i) {
      return (A - other_A) * points_.c(i) + (B - other_B) * points_.s(i) > 0;
    };
    const auto is_corner = [&](int k) {
      return k >= low && k <= high && first_is_nearer(k - 1) != first_is_nearer(k);
    };
    const int start = b.begin(), reach = std::max(start - low, high - start);
    int step = 0;
    while (step <= reach && !is_corner(start + step) && !is_corner(start - step)) ++step;
    if (step > reach) return meets;
    const int corner = is_corner(start + step) ? start + step : start - step;
    if (divided_at(a, b, corner).cost() > least + options_.corner_gate) return meets;
    divide_at(a, b, corner);
    meets = true;
  }
  return meets;
}

// True when returns in [from, to) lie behind the line of `both`: there is an opening.
bool SegmentExtractor::seen_through(const InverseRangeSums& both, int from, int to) const {
  double A = 0, B = 0;
  if (!both.solve(A, B)) return true;
  int behind = 0;
  for (int i = from; i < to; ++i) {
    const double q = A * points_.c(i) + B * points_.s(i);
    const double margin = std::max(kOpening, kOpeningSigmas * points_.sigma_r());
    behind += q > 0 && points_.r(i) > 1 / q + margin ? 1 : 0;
  }
  return behind >= 2;
}

// b follows a in beam order, over the seam when it begins before.
bool SegmentExtractor::can_bridge(const Run& a, const Run& b) const {
  const int i = a.end() - 1, j = b.begin();
  const bool wraps = j <= i;
  const int beams = points_.beam(j) - points_.beam(i) + (wraps ? points_.beams() : 0);
  const double separation = (points_.point(j) - points_.point(i)).norm();
  const double near = std::min(points_.r(i), points_.r(j));
  const double grazing = near * std::sin(increment_) / kGrazing;
  const double allowed = beams <= 1 ? std::max(options_.max_bridge, grazing) : options_.max_bridge;
  if (separation > allowed || beams * increment_ > M_PI / 2) return false;
  const InverseRangeSums both = a.sums + b.sums;
  if (!wraps) return !seen_through(both, i + 1, j);
  return !seen_through(both, i + 1, points_.size()) && !seen_through(both, 0, j);
}

void SegmentExtractor::bridge() {
  std::size_t kept = 0;
  for (std::size_t i = 1; i < runs_.size(); ++i) {
    if (merge_loss(runs_[kept], runs_[i]) < 0 && can_bridge(runs_[kept], runs_[i])) {
      append(runs_[kept], runs_[i]);
    } else if (++kept != i) {
      runs_[kept] = std::move(runs_[i]);
    }
  }
  if (!runs_.empty()) runs_.resize(kept + 1);
  merge_seam();
}

bool SegmentExtractor::acceptable(const ScanSegment& segment) const {
  if (segment.count < options_.min_points || segment.length() < options_.min_length) return false;
  if (!(segment.covariance(1, 1) < options_.max_sigma_theta * options_.max_sigma_theta)) {
    return false;
  }
  const double degrees = segment.count - 2;
  const double limit = options_.max_reduced_chi + 3 * std::sqrt(2 / degrees);
  if (segment.chi_squared > limit * degrees) return false;
  const double nearest = std::min(segment.start.norm(), segment.end.norm());
  if (segment.rho < nearest * std::cos(options_.max_incidence)) return false;
  int span = segment.last_beam - segment.first_beam;
  if (span < 0) span += points_.beams();
  return segment.count >= options_.min_fill * (span + 1);
}

void SegmentExtractor::emit(const Run& run, Segments& out) {
  indices_.clear();
  rejected_.clear();
  for (const auto& [begin, end] : run.parts) {
    for (int i = begin; i < end; ++i) indices_.push_back(i);
  }
  std::optional<ScanSegment> segment =
      fit_line(points_, indices_, run.sums, options_.outlier_sigma, rejected_);
  if (!segment || !acceptable(*segment)) return;
  // The moments keep what the returns themselves say.
  segment->covariance += run.uncertain_begin + run.uncertain_end + hidden_corner(run);
  for (const int i : indices_) used_[static_cast<std::size_t>(i)] = 1;
  for (const int i : rejected_) used_[static_cast<std::size_t>(i)] = 0;
  out.segments.push_back(*segment);
}

}  // namespace lamina
