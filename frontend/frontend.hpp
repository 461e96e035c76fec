// From measurements to what the mapper takes: one step for every scan and depth frame.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include <lamina/frontend/depth/depth_distortion.hpp>
#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/knock_watch.hpp>
#include <lamina/frontend/depth/tilted_start.hpp>
#include <lamina/frontend/depth_checks.hpp>
#include <lamina/frontend/frontend_options.hpp>
#include <lamina/frontend/motion/motion_estimator.hpp>
#include <lamina/frontend/motion/step.hpp>
#include <lamina/frontend/obstacles/coarse_depth.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/frontend/segments/checked_ranges.hpp>
#include <lamina/frontend/segments/segment_frontend.hpp>
#include <lamina/models/skipped.hpp>
#include <lamina/sensors/measurement.hpp>

namespace lamina {

/// Routes each measurement to its front-end, and all of them to the one MotionEstimator.
class FrontEnd {
 public:
  FrontEnd(const FrontEndOptions& options, const Calibration& calibration);

  /// nullopt for measurements that make no step of their own (odometry, accelerometer) or that
  /// could not be used (counted in skipped()). Stage times go to `diagnostics`.
  std::optional<Step> process(const Measurement& measurement, Diagnostics& diagnostics);

  /// What is taken out of every depth image from now on.
  void correct_depth(DepthDistortion distortion) { distortion_ = std::move(distortion); }
  const DepthDistortion& depth_distortion() const { return distortion_; }
  /// The body stands tilted where the recording begins; before the first measurement.
  void begin_tilted(const TiltedStart& start);
  /// The depth camera sits otherwise than calibrated; before the first measurement.
  void begin_with_mounting(const SE3& T_body_camera_calibrated, const Leveling& mounting) {
    floor_.begin(T_body_camera_calibrated, mounting);
  }
  /// How uneven the ground is, before the first measurement (MountingTracker::expect_ground).
  void expect_ground(const Leveling& sigma) { floor_.expect_ground(sigma); }
  /// What tells the motion, and all that can be told to it before the first measurement.
  MotionEstimator& motion() { return motion_; }
  const MotionEstimator& motion() const { return motion_; }

  /// What is claimed of scanners and depth cameras, against what they show.
  const CheckedRanges& ranges() const { return ranges_; }
  const DepthChecks& depth_checks() const { return depth_checks_; }
  /// Measurements that were left out, by reason.
  SkippedCounts skipped() const;

  /// For archives (models/archive.hpp): all that one measurement leaves to the next.
  template <class A>
  friend void fields(A& a, FrontEnd& v) {
    // All members by name: one more, and this no longer compiles until it is decided here.
    auto& [distortion, ranges, segments, floor, depth_checks, knocks, obstacles, last_sight, motion,
           skipped] = v;
    static_cast<void>(distortion);  // of the recording, before it is mapped
    static_cast<void>(obstacles);   // keeps buffers alone
    a(ranges, segments, depth_checks, knocks, last_sight, motion, skipped);
    if constexpr (A::kReading) {
      floor.load(a);
    } else {
      floor.save(a);
    }
  }

 private:
  std::optional<Step> process_scan(const LaserScan& scan, Diagnostics& diagnostics);
  std::optional<Step> process_depth(const DepthFrame& frame, SensorKind kind,
                                    Diagnostics& diagnostics);
  std::optional<Step> process_cloud(const CloudFrame& cloud, Diagnostics& diagnostics);
  std::nullopt_t stamp_goes_back();
  bool may_be_knocked(Timestamp stamp);
  FloorResult see_floor(const DepthFrame& frame, SensorKind kind, Diagnostics& diagnostics);

  DepthDistortion distortion_;  // taken out of depth images
  CheckedRanges ranges_;
  SegmentFrontend segments_;
  FloorFrontend floor_;
  DepthChecks depth_checks_;
  KnockWatch knocks_;
  ObstacleScanner obstacles_;
  std::optional<Timestamp> last_sight_;  // of the last image whose look was kept
  MotionEstimator motion_;
  SkippedCounts skipped_;
};

}  // namespace lamina
