// Which track a segment belongs to: gates, assignment, pieces, tracks that are one.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <lamina/frontend/segments/segment_tracker.hpp>

namespace lamina {
namespace {
// What an ambiguous match must be worse by before a newer track may take it from an older one.
constexpr double kSeniority = 2;
// A wall just seen is seen again nine times of ten, and one out of sight stays so: against a track
// that was seen, one that was not is behind by the odds of both, 2 log(9^2).
constexpr double kOutOfSight = 8.8;
// A missing overlap costs (gap / this)^2 (m).
constexpr double kGapScale = 0.5;
// The log-determinant term of the cost is taken relative to the slacks and held below this.
constexpr double kMaxLogTerm = 12;
// What stands beside a track with a gap between is often another wall, some centimetres deeper: it
// is a piece of the track only within 2 sigma.
constexpr double kBeside = 4;
// A motion like the one before: its covariance so many times, and so much of each of its parts.
constexpr double kSteadyFactor = 4, kChangeOfSpeed = 0.2;
// Odometry leaps when it changes by so many sigmas: no manoeuvre.
constexpr double kLeapSigmas = 10;

// A stretch of a segment's line.
struct Stretch {
  double low, high;
  double gap(const Stretch& o) const { return std::max(low, o.low) - std::min(high, o.high); }
  double length() const { return high - low; }
  // More than half of the shorter is common.
  bool shares(const Stretch& o) const { return -gap(o) > 0.5 * std::min(length(), o.length()); }
};

double along(const ScanSegment& segment, const Eigen::Vector2d& p) {
  return -std::sin(segment.theta) * p.x() + std::cos(segment.theta) * p.y();
}

Stretch stretch_of(const ScanSegment& segment) {
  const double a = along(segment, segment.start), b = along(segment, segment.end);
  return {std::min(a, b), std::max(a, b)};
}

Stretch stretch_of(const TrackPiece& piece, const ScanSegment& segment) {
  const double a = along(segment, piece.start.head<2>()), b = along(segment, piece.end.head<2>());
  return {std::min(a, b), std::max(a, b)};
}

bool shares(const SegmentTrack& track, const ScanSegment& segment) {
  const Stretch own = stretch_of(segment);
  return std::any_of(track.pieces.begin(), track.pieces.end(), [&](const TrackPiece& piece) {
    return stretch_of(piece, segment).shares(own);
  });
}

// From all that was seen of a track, what lies between included.
double gap_to(const SegmentTrack& track, const ScanSegment& segment) {
  Stretch all = stretch_of(track.pieces.front(), segment);
  for (const TrackPiece& piece : track.pieces) {
    const Stretch one = stretch_of(piece, segment);
    all = {std::min(all.low, one.low), std::max(all.high, one.high)};
  }
  return all.gap(stretch_of(segment));
}

std::ptrdiff_t held_tracks(const std::vector<SegmentTrack>& tracks) {
  return std::count_if(tracks.begin(), tracks.end(), [](const SegmentTrack& track) {
    return track.missed == 0 && track.proven();
  });
}

Matrix6d covariance_without_odometry(const TrackingOptions& options) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(options.no_odometry_sigma_m),
      Eigen::Vector3d::Constant(options.no_odometry_sigma_rad);
  return sigma.cwiseAbs2().asDiagonal();
}
}  // namespace

// Where the motion given loses all that was held: does another one keep it? Going on as before may
// be borne out by a single line, if what is given leaps away from it; standing still needs several,
// for one line that is gone may have ended or bent. Leaves the tracks predicted by what it decides
// for, and `T_prev_curr` that motion.
std::vector<int> SegmentTracker::uncertain_motion(const std::vector<ScanSegment>& segments,
                                                  const std::vector<SegmentTrack>& before,
                                                  std::vector<int> owner, SE3& T_prev_curr,
                                                  double interval) {
  constexpr int kLeastWitnesses = 3;
  contradicted_ = false;
  leap_.reset();
  const auto held = held_tracks(before);
  if (held == 0 || segments.empty() || lost(owner) < held) return owner;
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
    predict(SE3(), covariance_without_odometry(options_));
    const std::vector<int> still = match(segments);
    contradicted_ = 2 * lost(still) <= held;
    if (contradicted_) {
      T_prev_curr = SE3();
      return still;
    }
  }
  tracks_ = moved;
  return owner;
}

// Against what is unsure if it goes on as before: how unsure a leap itself claims to be is no
// excuse.
bool SegmentTracker::leaps(const SE3& T_given, const SE3& T_steady,
                           const Matrix6d& steady_covariance) const {
  const Vector6d off = (T_steady.inverse() * T_given).log();
  const Vector6d variances = steady_covariance.diagonal();
  return (off.array().square() > kLeapSigmas * kLeapSigmas * variances.array()).any();
}

// Squared Mahalanobis distance of predicted and seen line with the log-determinant that keeps a
// vague track from winning over a sure one; nullopt outside the gates.
std::optional<SegmentTracker::LineCost> SegmentTracker::match_cost(const SegmentTrack& track,
                                                                   const ScanSegment& segment,
                                                                   const Eigen::Matrix2d& R) const {
  const LinePrediction line = track.filter.line();
  const double turn = angle_difference(segment.theta, line.theta);
  if (std::abs(turn) > options_.max_angle) return std::nullopt;
  const double middle = along(segment, segment.moments.mean().head<2>());
  const double offset = segment.rho - line.rho - middle * turn;
  if (std::abs(offset) > options_.max_offset + 0.1 * segment.rho) return std::nullopt;

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
  return LineCost{squared, std::max(0.0, squared + 0.5 * log_term)};
}

// A row for each piece that was seen of each track.
std::vector<AssignmentCandidate> SegmentTracker::candidates(
    const std::vector<ScanSegment>& segments, std::vector<int>& track_of_row) const {
  std::vector<AssignmentCandidate> out;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const SegmentTrack& track = tracks_[t];
    const int first_row = static_cast<int>(track_of_row.size());
    track_of_row.resize(track_of_row.size() + track.pieces.size(), static_cast<int>(t));
    const double handicap =
        (track.proven() ? 0 : kSeniority) + (track.missed > 0 ? kOutOfSight : 0);
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const std::optional<LineCost> line = match_cost(track, segments[i], covariances_[i]);
      if (!line) continue;
      const Stretch own = stretch_of(segments[i]);
      for (std::size_t p = 0; p < track.pieces.size(); ++p) {
        const double gap = stretch_of(track.pieces[p], segments[i]).gap(own);
        if (gap > options_.slack_overlap) continue;
        const double apart = std::max(0.0, gap) / kGapScale;
        out.push_back({first_row + static_cast<int>(p), static_cast<int>(i),
                       line->cost + apart * apart + handicap});
      }
    }
  }
  return out;
}

std::vector<int> SegmentTracker::match(const std::vector<ScanSegment>& segments) const {
  std::vector<int> track_of_row;
  const std::vector<AssignmentCandidate> pairs = candidates(segments, track_of_row);
  const std::vector<int> column =
      assign(static_cast<int>(track_of_row.size()), static_cast<int>(segments.size()), pairs,
             options_.gate + kMaxLogTerm + kSeniority + kOutOfSight);
  std::vector<int> owner(segments.size(), -1);
  for (std::size_t row = 0; row < column.size(); ++row) {
    if (column[row] >= 0) owner[static_cast<std::size_t>(column[row])] = track_of_row[row];
  }
  continue_pieces(segments, owner);
  return owner;
}

// A wall that falls in two: where a proven track was a scan ago, what fits it is of it, unless a
// track long unseen fits by more.
void SegmentTracker::continue_pieces(const std::vector<ScanSegment>& segments,
                                     std::vector<int>& owner) const {
  for (std::size_t i = 0; i < segments.size(); ++i) {
    double best = options_.gate;
    if (owner[i] >= 0) {
      const SegmentTrack& held = tracks_[static_cast<std::size_t>(owner[i])];
      if (held.missed == 0) continue;
      best = match_cost(held, segments[i], covariances_[i])->cost + kOutOfSight;
    }
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      if (!tracks_[t].proven() || tracks_[t].missed > 0 || !shares(tracks_[t], segments[i]))
        continue;
      const std::optional<LineCost> line = match_cost(tracks_[t], segments[i], covariances_[i]);
      if (!line || line->cost >= best) continue;
      best = line->cost;
      owner[i] = static_cast<int>(t);
    }
  }
}

// Proven tracks of the scan before that found no segment.
int SegmentTracker::lost(const std::vector<int>& owner) const {
  int n = 0;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const SegmentTrack& track = tracks_[t];
    n += track.missed == 0 && track.proven() &&
                 std::find(owner.begin(), owner.end(), static_cast<int>(t)) == owner.end()
             ? 1
             : 0;
  }
  return n;
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
      if (!track.proven()) continue;
      const double gap = gap_to(track, segments[i]);
      if (gap > options_.max_fragment_gap) continue;
      const std::optional<LineCost> line = match_cost(track, segments[i], covariances_[i]);
      if (!line) continue;
      const double apart = std::max(0.0, gap) / kGapScale, cost = line->cost + apart * apart;
      if (cost >= best) continue;
      best = cost;
      owner[i] = t;
    }
    if (owner[i] < 0) continue;
    ++counts_.fragments;
    add_piece(tracks_[static_cast<std::size_t>(owner[i])], segments[i], i);
  }
}

// The proven track that a young one is about to become known beside, or was all the time: beside it
// in this scan, or out of sight for a while. All the young one saw counts, not only its last line.
int SegmentTracker::elder_of(int young, const ScanSegment& segment) const {
  const SegmentTrack& track = tracks_[static_cast<std::size_t>(young)];
  const LinePrediction seen = track.filter.line();
  ScanSegment line = segment;
  line.rho = seen.rho;
  line.theta = seen.theta;
  int elder = -1;
  double best = options_.gate;
  for (int t = 0; t < static_cast<int>(tracks_.size()); ++t) {
    const SegmentTrack& other = tracks_[static_cast<std::size_t>(t)];
    const bool earlier = other.observations > other.needed ||
                         (other.observations == other.needed && other.id < track.id);
    if (t == young || !earlier) continue;
    const double gap = gap_to(other, line);
    const bool apart = gap > options_.slack_overlap;
    if (apart && (other.missed > 0 || gap > options_.max_fragment_gap)) continue;
    const std::optional<LineCost> cost = match_cost(other, line, seen.covariance);
    if (!cost || cost->cost >= best || (apart && cost->squared > kBeside)) continue;
    best = cost->cost;
    elder = t;
  }
  return elder;
}

// Before a track gets an id: is it one that has one?
void SegmentTracker::join_elders(const std::vector<ScanSegment>& segments, std::vector<int>& owner,
                                 Timestamp stamp) {
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (owner[i] < 0) continue;
    const int young = owner[i];
    SegmentTrack& track = tracks_[static_cast<std::size_t>(young)];
    if (track.observations != track.needed || track.needed == 1) continue;
    const int elder = elder_of(young, segments[i]);
    if (elder < 0) continue;
    SegmentTrack& other = tracks_[static_cast<std::size_t>(elder)];
    for (std::size_t k = i; k < segments.size(); ++k) {
      if (owner[k] != young) continue;
      owner[k] = elder;
      if (other.missed > 0) {
        observe(other, segments[k], k, stamp);
      } else {
        add_piece(other, segments[k], k);
      }
    }
    track.observations = 0;  // it goes when the scan is done
    track.missed = 2;
    --counts_.confirmed;
    ++counts_.joined;
  }
}

}  // namespace lamina
