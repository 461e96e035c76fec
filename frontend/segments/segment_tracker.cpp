// Prediction, life and death of tracks.
#include <lamina/frontend/segments/segment_tracker.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {
// A tilt is known once its sigma (of k) is below this: only then can a track be seen to bend.
constexpr double kKnownTilt = 0.3;

TrackPiece piece_of(const ScanSegment& segment) {
  return {{segment.start.x(), segment.start.y(), 0}, {segment.end.x(), segment.end.y(), 0}};
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
  std::vector<int> owner = uncertain_motion(segments, before, match(segments), motion, interval);
  last_motion_ = motion;
  if (!leap_) last_covariance_ = motion_covariance;
  last_interval_ = interval;
  last_stamp_ = stamp;
  take(segments, owner, stamp);
  share_fragments(segments, owner);
  join_elders(segments, owner, stamp);
  std::vector<std::int64_t> ids(segments.size(), -1);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (owner[i] < 0) {
      owner[i] = static_cast<int>(tracks_.size());
      tracks_.push_back(born(segments[i], i, stamp));
    }
    const SegmentTrack& track = tracks_[static_cast<std::size_t>(owner[i])];
    if (track.proven()) ids[i] = track.id;
  }
  retire(stamp);
  return ids;
}

// The longest stretch tells whether a track bends; the others only add to it.
void SegmentTracker::take(const std::vector<ScanSegment>& segments, const std::vector<int>& owner,
                          Timestamp stamp) {
  std::vector<std::vector<std::size_t>> taken(tracks_.size());
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (owner[i] >= 0) taken[static_cast<std::size_t>(owner[i])].push_back(i);
  }
  for (std::size_t t = 0; t < taken.size(); ++t) {
    if (taken[t].empty()) {
      ++tracks_[t].missed;
      continue;
    }
    std::stable_sort(taken[t].begin(), taken[t].end(), [&](std::size_t a, std::size_t b) {
      return segments[a].count > segments[b].count;
    });
    observe(tracks_[t], segments[taken[t].front()], taken[t].front(), stamp);
    for (std::size_t k = 1; k < taken[t].size(); ++k) {
      add_piece(tracks_[t], segments[taken[t][k]], taken[t][k]);
    }
  }
}

void SegmentTracker::add_piece(SegmentTrack& track, const ScanSegment& segment, std::size_t index) {
  track.filter.update(segment, covariances_[index]);
  track.pieces.push_back(piece_of(segment));
}

void SegmentTracker::predict(const SE3& T_curr_prev, const Matrix6d& covariance) {
  std::erase_if(tracks_, [&](SegmentTrack& track) {
    track.seen = false;
    for (TrackPiece& piece : track.pieces) {
      piece = {T_curr_prev * piece.start, T_curr_prev * piece.end};
    }
    if (track.filter.predict(T_curr_prev, covariance)) return false;
    ++counts_.deaths;
    return true;
  });
}

// One-sided sums of whitened innovations, at the segment's middle [Page1954].
bool SegmentTracker::bends(SegmentTrack& track, const ScanSegment& segment,
                           const Eigen::Matrix2d& R) {
  const LinePrediction line = track.filter.line();
  if (track.filter.sigma_tilt() > kKnownTilt) return false;
  const Eigen::Vector3d& mean = segment.moments.mean();
  const double middle = -std::sin(segment.theta) * mean.x() + std::cos(segment.theta) * mean.y();
  const Eigen::Vector2d h(1, -middle);
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
                     {piece_of(segment)},
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
  track.pieces = {piece_of(segment)};
  if (track.missed > 0) ++counts_.reacquired;
  track.missed = 0;
  track.last_seen = stamp;
  track.seen = true;
  if (++track.observations == track.needed) ++counts_.confirmed;
}

void SegmentTracker::retire(Timestamp stamp) {
  std::erase_if(tracks_, [&](const SegmentTrack& track) {
    const bool unproven = !track.proven() && track.missed > 1;
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
