// Prediction, gates, assignment, life and death of tracks.
#include <lamina/frontend/segments/segment_tracker.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {
// What an ambiguous match must be worse by before a newer track may take it from an older one.
constexpr double kSeniority = 2;
// A missing overlap costs (gap / this)^2 (m).
constexpr double kGapScale = 0.5;
// The log-determinant term of the cost is taken relative to the slacks and held below this.
constexpr double kMaxLogTerm = 12;
// A tilt is known once its sigma (of k) is below this: only then can a track be seen to bend.
constexpr double kKnownTilt = 0.3;
// A motion like the one before: its covariance so many times, and so much of each of its parts.
constexpr double kSteadyFactor = 4, kChangeOfSpeed = 0.2;
// Odometry leaps when it changes by so many sigmas: no manoeuvre.
constexpr double kLeapSigmas = 10;

// Extent of a track and a segment along the segment's line.
struct Overlap {
  double gap;  // negative: they overlap by that much
};

Overlap overlap_of(const SegmentTrack& track, const ScanSegment& segment) {
  const Eigen::Vector2d along(-std::sin(segment.theta), std::cos(segment.theta));
  const double a = along.dot(track.start.head<2>()), b = along.dot(track.end.head<2>());
  const double c = along.dot(segment.start), d = along.dot(segment.end);
  return {std::max(std::min(a, b), std::min(c, d)) - std::min(std::max(a, b), std::max(c, d))};
}

double middle_along(const ScanSegment& segment) {
  const Eigen::Vector3d& mean = segment.moments.mean();
  return -std::sin(segment.theta) * mean.x() + std::cos(segment.theta) * mean.y();
}
}  // namespace

SegmentTracker::SegmentTracker(TrackingOptions options) : options_(options) {
  const std::vector<std::string> problems = options_.problems();
  if (!problems.empty()) throw Error(problems.front());
}

std::vector<std::int64_t> SegmentTracker::update(const std::vector<ScanSegment>& segments,
                                                 const std::vector<NoiseFloor>& floors,
                                                 Timestamp stamp, const SE3& T_prev_curr_scanner,
                                                 const Matrix6d& motion_covariance) {
  LAMINA_CHECK(segments.size() == floors.size());
  floors_ = floors;
  covariances_.clear();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    covariances_.push_back(observation_covariance(segments[i], floors[i]));
  }
  const std::vector<SegmentTrack> before = tracks_;
  predict(T_prev_curr_scanner.inverse(), motion_covariance);
  SE3 motion = T_prev_curr_scanner;
  const double interval = last_stamp_ ? stamp - *last_stamp_ : 0;
  const std::vector<int> column = doubt_motion(segments, before, match(segments), motion, interval);
  last_motion_ = motion;
  if (!leap_) last_covariance_ = motion_covariance;
  last_interval_ = interval;
  last_stamp_ = stamp;
  const std::size_t known = tracks_.size();
  std::vector<int> owner(segments.size(), -1);
  for (std::size_t t = 0; t < known; ++t) {
    if (column[t] < 0) {
      ++tracks_[t].missed;
      continue;
    }
    const std::size_t index = static_cast<std::size_t>(column[t]);
    owner[index] = static_cast<int>(t);
    observe(tracks_[t], segments[index], index, stamp);
  }
  share_fragments(segments, owner);
  std::vector<std::int64_t> ids(segments.size(), -1);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (owner[i] < 0) {
      owner[i] = static_cast<int>(tracks_.size());
      tracks_.push_back(born(segments[i], i, stamp));
    }
    const SegmentTrack& track = tracks_[static_cast<std::size_t>(owner[i])];
    if (track.observations >= track.needed) ids[i] = track.id;
  }
  retire(stamp);
  return ids;
}

// Where the motion given loses all that was held: does another one keep it? Going on as before may
// be borne out by a single line, if what is given leaps away from it; standing still needs several,
// for one line that is gone may have ended or bent. Leaves the tracks predicted by what it decides
// for, and `T_prev_curr` that motion.
std::vector<int> SegmentTracker::doubt_motion(const std::vector<ScanSegment>& segments,
                                              const std::vector<SegmentTrack>& before,
                                              std::vector<int> column, SE3& T_prev_curr,
                                              double interval) {
  constexpr int kLeastWitnesses = 3;
  contradicted_ = false;
  leap_.reset();
  const auto held = std::count_if(before.begin(), before.end(), [](const SegmentTrack& track) {
    return track.missed == 0 && track.observations >= track.needed;
  });
  if (held == 0 || segments.empty() || lost(column) < held) return column;
  const std::vector<SegmentTrack> moved = tracks_;
  if (last_interval_ > 0 && interval > 0) {
    const Vector6d steady = (interval / last_interval_) * last_motion_.log();
    const SE3 T_steady = SE3::exp(steady);
    Matrix6d unsure = kSteadyFactor * (interval / last_interval_) * last_covariance_;
    unsure.diagonal() += (kChangeOfSpeed * steady).cwiseAbs2();
    if (leaps(T_prev_curr, T_steady, unsure)) {
      tracks_ = before;
      predict(T_steady.inverse(), unsure);
      const std::vector<int> on = match(segments);
      contradicted_ = 2 * lost(on) <= held;
      if (contradicted_) {
        leap_ = (T_steady.inverse() * T_prev_curr).log();
        T_prev_curr = T_steady;
        return on;
      }
    }
  }
  if (held >= kLeastWitnesses) {
    tracks_ = before;
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(options_.no_odometry_sigma_m),
        Eigen::Vector3d::Constant(options_.no_odometry_sigma_rad);
    predict(SE3(), sigma.cwiseAbs2().asDiagonal());
    const std::vector<int> still = match(segments);
    contradicted_ = 2 * lost(still) <= held;
    if (contradicted_) {
      T_prev_curr = SE3();
      return still;
    }
  }
  tracks_ = moved;
  return column;
}

// Against what is unsure if it goes on as before: how unsure a leap itself claims to be is no
// excuse.
bool SegmentTracker::leaps(const SE3& T_given, const SE3& T_steady,
                           const Matrix6d& steady_covariance) const {
  const Vector6d off = (T_steady.inverse() * T_given).log();
  const Vector6d variances = steady_covariance.diagonal();
  return (off.array().square() > kLeapSigmas * kLeapSigmas * variances.array()).any();
}

// The best assignment: the segment of each track, -1 for none.
std::vector<int> SegmentTracker::match(const std::vector<ScanSegment>& segments) const {
  return assign(static_cast<int>(tracks_.size()), static_cast<int>(segments.size()),
                candidates(segments), options_.gate + kMaxLogTerm);
}

// Proven tracks of the scan before that found no segment.
int SegmentTracker::lost(const std::vector<int>& column) const {
  int n = 0;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const SegmentTrack& track = tracks_[t];
    n += track.missed == 0 && track.observations >= track.needed && column[t] < 0 ? 1 : 0;
  }
  return n;
}

void SegmentTracker::predict(const SE3& T_curr_prev, const Matrix6d& covariance) {
  std::erase_if(tracks_, [&](SegmentTrack& track) {
    track.seen = false;
    track.start = T_curr_prev * track.start;
    track.end = T_curr_prev * track.end;
    if (track.filter.predict(T_curr_prev, covariance)) return false;
    ++counts_.deaths;
    return true;
  });
}

// Squared Mahalanobis distance of predicted and seen line with the log-determinant that keeps a
// vague track from winning over a sure one, and the overlap; nullopt outside the gates.
std::optional<double> SegmentTracker::match_cost(const SegmentTrack& track,
                                                 const ScanSegment& segment,
                                                 const Eigen::Matrix2d& R,
                                                 double allowed_gap) const {
  const LinePrediction line = track.filter.line();
  const double turn = angle_difference(segment.theta, line.theta);
  if (std::abs(turn) > options_.max_angle) return std::nullopt;
  const double middle = middle_along(segment);
  const double offset = segment.rho - line.rho - middle * turn;
  if (std::abs(offset) > options_.max_offset + 0.1 * segment.rho) return std::nullopt;
  const double gap = overlap_of(track, segment).gap;
  if (gap > allowed_gap) return std::nullopt;

  // In (offset at the segment's middle, angle): there the two are nearly independent.
  Eigen::Matrix2d J;
  J << 1, -middle, 0, 1;
  Eigen::Matrix2d S = J * (line.covariance + R) * J.transpose();
  const double slack_rho = options_.slack_rho, slack_theta = options_.slack_theta;
  S(0, 0) += slack_rho * slack_rho;
  S(1, 1) += slack_theta * slack_theta;
  const double determinant = S.determinant();
  if (!(determinant > 0)) return std::nullopt;
  const double squared =
      (S(1, 1) * offset * offset - 2 * S(0, 1) * offset * turn + S(0, 0) * turn * turn) /
      determinant;
  if (!(squared < options_.gate)) return std::nullopt;
  const double floor = slack_rho * slack_rho * slack_theta * slack_theta;
  const double log_term = floor > 0 ? std::min(kMaxLogTerm, std::log(determinant / floor)) : 0;
  const double apart = std::max(0.0, gap) / kGapScale;
  const double newcomer = track.observations >= track.needed ? 0 : kSeniority;
  return std::max(0.0, squared + 0.5 * log_term + apart * apart + newcomer);
}

std::vector<AssignmentCandidate> SegmentTracker::candidates(
    const std::vector<ScanSegment>& segments) const {
  std::vector<AssignmentCandidate> out;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const std::optional<double> cost =
          match_cost(tracks_[t], segments[i], covariances_[i], options_.slack_overlap);
      if (cost) out.push_back({static_cast<int>(t), static_cast<int>(i), *cost});
    }
  }
  return out;
}

// One-sided sums of whitened innovations, at the segment's middle [Page1954].
bool SegmentTracker::bends(SegmentTrack& track, const ScanSegment& segment,
                           const Eigen::Matrix2d& R) {
  const LinePrediction line = track.filter.line();
  if (track.filter.sigma_tilt() > kKnownTilt) return false;
  const Eigen::Vector2d h(1, -middle_along(segment));
  const Eigen::Vector2d innovation(segment.rho - line.rho,
                                   angle_difference(segment.theta, line.theta));
  const double variance = h.dot((line.covariance + R) * h);
  const double value = h.dot(innovation) / std::sqrt(std::max(variance, 1e-12));
  track.cusum_up = std::max(0.0, track.cusum_up + value - options_.bend_drift);
  track.cusum_down = std::max(0.0, track.cusum_down - value - options_.bend_drift);
  return std::max(track.cusum_up, track.cusum_down) > options_.bend_threshold;
}

SegmentTrack SegmentTracker::born(const ScanSegment& segment, std::size_t index, Timestamp stamp) {
  ++counts_.births;
  SegmentTrack track{next_id_++,
                     PlaneFilter(segment, floors_[index], options_.sigma_tilt),
                     {segment.start.x(), segment.start.y(), 0},
                     {segment.end.x(), segment.end.y(), 0},
                     stamp,
                     stamp};
  track.needed = options_.min_observations;
  if (track.needed <= 1) ++counts_.confirmed;
  return track;
}

void SegmentTracker::observe(SegmentTrack& track, const ScanSegment& segment, std::size_t index,
                             Timestamp stamp) {
  if (bends(track, segment, covariances_[index])) {
    ++counts_.bends;
    SegmentTrack next = born(segment, index, stamp);
    next.bends = track.bends + 1;
    if (track.bends > 0) next.needed = std::max(next.needed, track.observations + 1);
    track = next;
    return;
  }
  track.filter.update(segment, covariances_[index]);
  track.start = {segment.start.x(), segment.start.y(), 0};
  track.end = {segment.end.x(), segment.end.y(), 0};
  if (track.missed > 0) ++counts_.reacquired;
  track.missed = 0;
  track.last_seen = stamp;
  track.seen = true;
  if (++track.observations == track.needed) ++counts_.confirmed;
}

// A segment nobody claimed that continues a wall seen in this scan is a piece of it.
void SegmentTracker::share_fragments(const std::vector<ScanSegment>& segments,
                                     std::vector<int>& owner) {
  const std::vector<int> first_owner = owner;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (owner[i] >= 0) continue;
    double best = options_.gate;
    for (const int t : first_owner) {
      if (t < 0) continue;
      const SegmentTrack& track = tracks_[static_cast<std::size_t>(t)];
      if (track.observations < track.needed) continue;
      const std::optional<double> cost =
          match_cost(track, segments[i], covariances_[i], options_.max_fragment_gap);
      if (!cost || *cost >= best) continue;
      best = *cost;
      owner[i] = t;
    }
    if (owner[i] < 0) continue;
    ++counts_.fragments;
    SegmentTrack& track = tracks_[static_cast<std::size_t>(owner[i])];
    track.filter.update(segments[i], covariances_[i]);
    const Eigen::Vector2d along(-std::sin(segments[i].theta), std::cos(segments[i].theta));
    for (const Eigen::Vector2d& p : {segments[i].start, segments[i].end}) {
      Eigen::Vector3d& low = along.dot(track.start.head<2>()) < along.dot(track.end.head<2>())
                                 ? track.start
                                 : track.end;
      Eigen::Vector3d& high = &low == &track.start ? track.end : track.start;
      if (along.dot(p) < along.dot(low.head<2>())) low = {p.x(), p.y(), 0};
      if (along.dot(p) > along.dot(high.head<2>())) high = {p.x(), p.y(), 0};
    }
  }
}

void SegmentTracker::retire(Timestamp stamp) {
  std::erase_if(tracks_, [&](const SegmentTrack& track) {
    const bool unproven = track.observations < track.needed && track.missed > 1;
    const bool forgotten =
        track.missed > options_.max_coast_scans && stamp - track.last_seen > options_.max_coast_s;
    if (!unproven && !forgotten) return false;
    ++counts_.deaths;
    return true;
  });
}

bool SegmentTracker::set_plane(std::int64_t track, const Plane& plane_scanner,
                               const Eigen::Matrix3d& covariance) {
  for (SegmentTrack& candidate : tracks_) {
    if (candidate.id != track) continue;
    const std::optional<PlaneFilter> filter = PlaneFilter::from_plane(plane_scanner, covariance);
    if (filter) candidate.filter = *filter;
    return filter.has_value();
  }
  return false;
}

}  // namespace lamina
