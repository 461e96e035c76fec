// Follows segments from scan to scan: the same plane keeps the same id.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/frontend/segments/assignment.hpp>
#include <lamina/frontend/segments/plane_filter.hpp>
#include <lamina/frontend/segments/segment_options.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// One stretch of a followed plane.
struct TrackPiece {
  Eigen::Vector3d start, end;  ///< m
};
template <class A>
void fields(A& a, TrackPiece& v) {
  a(v.start, v.end);
}

/// One followed plane. Geometry in the scanner's frame of the last scan.
struct SegmentTrack {
  std::int64_t id = -1;
  PlaneFilter filter;
  std::vector<TrackPiece> pieces;  ///< of its last sighting, carried along
  Timestamp first_seen, last_seen;
  int observations = 1;
  int missed = 0;  ///< scans since it was seen
  int needed = 1;  ///< observations before it counts
  int bends = 0;   ///< how many bends in a row led to it
  double cusum_up = 0, cusum_down = 0;
  bool seen = true;  ///< in the last scan

  bool proven() const { return observations >= needed; }
};

template <class A>
void fields(A& a, SegmentTrack& v) {
  a(v.id, v.filter, v.pieces, v.first_seen, v.last_seen, v.observations, v.missed, v.needed,
    v.bends, v.cusum_up, v.cusum_down, v.seen);
}

struct TrackingCounts {
  std::int64_t births = 0, confirmed = 0, deaths = 0, bends = 0, reacquired = 0, fragments = 0;
  std::int64_t joined = 0;  ///< proved to be an older track before they got an id
};
template <class A>
void fields(A& a, TrackingCounts& v) {
  a(v.births, v.confirmed, v.deaths, v.bends, v.reacquired, v.fragments, v.joined);
}

/// The method of [Laser planes document, 2.2-2.3]: a segment continues the track whose *predicted*
/// line it is collinear with (equations 1, 2: here a Mahalanobis distance over rho and theta, with
/// the plane's unknown tilt, the motion's and both lines' uncertainty) and overlaps (equation 3).
/// The assignment is the globally best of a scan, not the first found (equation 4 chooses per
/// segment). All pieces of a wall that were seen in the scan before are candidates, so a wall that
/// falls in two keeps its id on both sides; a track out of sight must fit better than one just
/// seen; and before a track gets an id, it must not be an older one. Pieces beyond a door share its
/// id. A track whose innovations lean to one side once its tilt is known is no plane: it ends, and
/// what is seen from then on is a new track; after two bends in a row a piece must outlive the one
/// before it to count, so a vault or a tank never does.
class SegmentTracker {
 public:
  /// Throws lamina::Error for options that have problems().
  explicit SegmentTracker(TrackingOptions options = {});

  /// Takes the segments of one scan; returns the track id of each, -1 while its track has not been
  /// seen often enough. `T_prev_curr_scanner`: the scanner's motion since the last call, with its
  /// covariance in the right tangent (translation, rotation).
  std::vector<std::int64_t> update(const std::vector<ScanSegment>& segments,
                                   const std::vector<NoiseFloor>& floors, Timestamp stamp,
                                   const SE3& T_prev_curr_scanner,
                                   const Matrix6d& motion_covariance);
  /// Predicts `track` from an estimated plane from now on: in the frame of the last scan, with its
  /// covariance in the plane's boxplus tangent. False when there is no such track, or a scan cannot
  /// see the plane.
  bool set_plane(std::int64_t track, const Plane& plane_scanner, const Eigen::Matrix3d& covariance);

  const std::vector<SegmentTrack>& tracks() const { return tracks_; }
  /// The last motion fitted none of the tracks just seen, while holding still fits most of them:
  /// the motion is wrong, and tracks were followed without it.
  bool contradicted() const { return contradicted_; }
  /// What a contradicted motion is off the one that fits, T_given = T_fits * exp(leap), in the
  /// scanner's frame: where going on as before fits, even by one line, and the given motion leaps
  /// away from that by far more than both are unsure. A fault of odometry, then: a wall that ends
  /// or bends is not where it would be without it.
  const std::optional<Vector6d>& leap() const { return leap_; }
  const TrackingCounts& counts() const { return counts_; }
  const TrackingOptions& options() const { return options_; }

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, SegmentTracker& v) {
    a(v.tracks_, v.next_id_, v.counts_, v.contradicted_, v.last_motion_, v.last_covariance_,
      v.last_interval_, v.last_stamp_);
  }

 private:
  struct LineCost {
    double squared, cost;  // Mahalanobis distance; what the assignment weighs
  };
  void predict(const SE3& T_curr_prev, const Matrix6d& covariance);
  // Which track each segment belongs to, -1: none (segment_match.cpp).
  std::vector<int> match(const std::vector<ScanSegment>& segments) const;
  std::vector<int> uncertain_motion(const std::vector<ScanSegment>& segments,
                                    const std::vector<SegmentTrack>& before, std::vector<int> owner,
                                    SE3& T_prev_curr, double interval);
  bool leaps(const SE3& T_given, const SE3& T_steady, const Matrix6d& steady_covariance) const;
  int lost(const std::vector<int>& owner) const;
  std::vector<AssignmentCandidate> candidates(const std::vector<ScanSegment>& segments,
                                              std::vector<int>& track_of_row) const;
  void continue_pieces(const std::vector<ScanSegment>& segments, std::vector<int>& owner) const;
  std::optional<LineCost> match_cost(const SegmentTrack& track, const ScanSegment& segment,
                                     const Eigen::Matrix2d& R) const;
  // What becomes of the tracks (segment_tracker.cpp).
  void take(const std::vector<ScanSegment>& segments, const std::vector<int>& owner,
            Timestamp stamp);
  void observe(SegmentTrack& track, const ScanSegment& segment, std::size_t index, Timestamp stamp);
  void add_piece(SegmentTrack& track, const ScanSegment& segment, std::size_t index);
  bool bends(SegmentTrack& track, const ScanSegment& segment, const Eigen::Matrix2d& R);
  SegmentTrack born(const ScanSegment& segment, std::size_t index, Timestamp stamp);
  void share_fragments(const std::vector<ScanSegment>& segments, std::vector<int>& owner);
  int elder_of(int young, const ScanSegment& segment) const;
  void join_elders(const std::vector<ScanSegment>& segments, std::vector<int>& owner,
                   Timestamp stamp);
  void retire(Timestamp stamp);

  TrackingOptions options_;
  std::vector<SegmentTrack> tracks_;
  std::vector<Eigen::Matrix2d> covariances_;  // of this scan's segments, floor included
  std::vector<NoiseFloor> floors_;
  bool contradicted_ = false;
  std::optional<Vector6d> leap_;
  SE3 last_motion_;  // between the two scans before, with what is not known of it
  Matrix6d last_covariance_ = Matrix6d::Zero();
  double last_interval_ = 0;  // s; 0: none
  std::optional<Timestamp> last_stamp_;
  std::int64_t next_id_ = 0;
  TrackingCounts counts_;
};

}  // namespace lamina
