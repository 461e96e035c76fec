// The room's one call: a 2D scan to what the backend wants to know of it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include <lamina/frontend/segments/segment_extractor.hpp>
#include <lamina/frontend/segments/segment_tracker.hpp>
#include <lamina/models/observation.hpp>
#include <lamina/models/skipped.hpp>

namespace lamina {

/// Scan -> segments -> tracks -> Observations. The scanner may be mounted in any attitude (scan
/// level, upright, looking down): nothing here knows which way is up.
class SegmentFrontend {
 public:
  /// Throws lamina::Error for options that have problems().
  explicit SegmentFrontend(const SegmentOptions& segments = {},
                           const TrackingOptions& tracking = {});

  /// Segments with track ids (scanner frame), loose points (body frame). `T_prev_curr_body`: the
  /// body's motion since the last call, from odometry; without it a wide search is made.
  /// Scans that cannot be used give no segments and are counted in skipped(): no beams, no
  /// returns, bad geometry, a stamp that repeats or goes back; their motion is not lost.
  Observations process(const LaserScan& scan, const std::optional<SE3>& T_prev_curr_body);

  /// Predicts a track from the backend's plane from now on (body frame of the last scan).
  bool set_plane(std::int64_t track, const Plane& plane_body, const Eigen::Matrix3d& covariance);

  /// The last scan's segments and loose beams.
  const Segments& last() const { return last_; }
  const SegmentTracker& tracker() const { return tracker_; }
  /// Scans that were not used, by reason.
  const SkippedCounts& skipped() const { return skipped_; }

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, SegmentFrontend& v) {
    a(v.tracker_, v.skipped_, v.last_stamp_, v.T_body_lidar_, v.pending_motion_,
      v.pending_covariance_);
  }

 private:
  bool usable(const LaserScan& scan);
  Matrix6d motion_covariance(const std::optional<SE3>& T_prev_curr_body) const;
  void track(const LaserScan& scan, Observations& out);

  SegmentExtractor extractor_;
  SegmentTracker tracker_;
  Segments last_;
  SkippedCounts skipped_;
  std::optional<Timestamp> last_stamp_;
  SE3 T_body_lidar_;
  SE3 pending_motion_;  // of the body, since the tracker's last scan
  Matrix6d pending_covariance_ = Matrix6d::Zero();
};

/// What the returns of a segment share: the lidar's range_floor, and the tilt it can cause.
NoiseFloor noise_floor(const ScanSegment& segment, const LidarNoise& noise);

}  // namespace lamina
