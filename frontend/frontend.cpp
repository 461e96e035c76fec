// Routing of measurements.
#include <lamina/frontend/frontend.hpp>

#include <utility>

namespace lamina {
namespace {

// Tracks are predicted with the wheels' own uncertainty.
TrackingOptions tracking_of(const FrontEndOptions& options, const Calibration& calibration) {
  TrackingOptions tracking = options.tracking;
  tracking.odometry = calibration.odometry;
  return tracking;
}

// The floor tells how a camera is mounted on a body that stands on it. One that flies or is carried
// tilts: what tilts with it is no mounting.
FloorOptions floor_options(const FrontEndOptions& options, bool planar) {
  FloorOptions floor = options.floor;
  floor.self_calibrate = floor.self_calibrate && planar;
  return floor;
}

// What the floor front-end says in the frame levelled by this image's floor, in that of the body.
void bring_to_body(const FloorResult& floor, Step& step) {
  step.T_body_levelled = step.observations.T_body_sensor * floor.T_body_camera.inverse();
  for (Surfel& surfel : step.observations.surfels_body) {
    surfel = surfel.transformed(step.T_body_levelled);
  }
  for (Eigen::Vector3d& point : step.observations.obstacle_points_body) {
    point = step.T_body_levelled * point;
  }
}

}  // namespace

FrontEnd::FrontEnd(const FrontEndOptions& options, const Calibration& calibration)
    : segments_(options.segments, tracking_of(options, calibration)),
      floor_(floor_options(options, calibration.odometry.planar)),
      obstacles_(scan_options(options)),
      motion_(options, calibration) {}

void FrontEnd::begin_tilted(const TiltedStart& start) {
  floor_.begin(start.T_body_camera, start.usual);
  motion_.begin_tilted(start.T_level_body());
}

std::optional<Step> FrontEnd::process(const Measurement& measurement, Diagnostics& diagnostics) {
  if (const auto* odometry = std::get_if<Odometry>(&measurement)) {
    motion_.wheels().add(*odometry);
  } else if (const auto* scan = std::get_if<LaserScan>(&measurement)) {
    return process_scan(ranges_.apply(*scan), diagnostics);
  } else if (const auto* depth = std::get_if<DepthFrame>(&measurement)) {
    if (distortion_.empty()) return process_depth(*depth, SensorKind::kDepth, diagnostics);
    DepthFrame frame = *depth;
    distortion_.correct(frame);
    return process_depth(frame, SensorKind::kDepth, diagnostics);
  } else if (const auto* pair = std::get_if<StereoFrame>(&measurement)) {
    const DepthFrame frame = [&] {
      const auto timer = diagnostics.time("stereo");
      return depth_from_stereo(*pair);
    }();
    return process_depth(frame, SensorKind::kStereo, diagnostics);
  } else if (const auto* cloud = std::get_if<CloudFrame>(&measurement)) {
    return process_cloud(*cloud, diagnostics);
  }
  return std::nullopt;
}

std::nullopt_t FrontEnd::stamp_goes_back() {
  ++skipped_["stamp goes back"];
  return std::nullopt;
}

std::optional<Step> FrontEnd::process_scan(const LaserScan& scan, Diagnostics& diagnostics) {
  if (!motion_.begin(scan.stamp)) return stamp_goes_back();
  Step step;
  MatchedScan matched = motion_.match(scan, diagnostics);
  if (matched.wants_walls) {
    const auto timer = diagnostics.time("segments");
    step.observations = segments_.process(matched.scan, matched.moved);
  }
  const SegmentTracker& tracker = segments_.tracker();
  if (!matched.level && matched.guessed && tracker.contradicted()) {
    ++skipped_["odometry that every scan line contradicts"];
    matched.contradicted = true;
    matched.leap = tracker.leap();
  }
  motion_.accept(matched, step);
  step.scan = std::move(matched.scan);
  return step;
}

// A floor that is off where the ground slopes is no knocked camera, however long it is looked at.
// Nor is one where the body is known to stand tilted: until its wheels are off that. Without wheels
// there is no telling how far it came.
bool FrontEnd::may_be_knocked(Timestamp stamp) {
  const bool long_enough = knocks_.may_be(floor_.floor_off(), motion_.T_start_body());
  return (long_enough || !motion_.wheels().met()) && !motion_.at_tilted_start() &&
         !motion_.slopes().two_of_late(stamp);
}

FloorResult FrontEnd::see_floor(const DepthFrame& frame, SensorKind kind,
                                Diagnostics& diagnostics) {
  const auto timer = diagnostics.time("floor");
  floor_.accept_knocks(may_be_knocked(frame.stamp));
  FloorResult floor = floor_.process(frame);
  floor.sensor = kind;
  depth_checks_.add(frame, floor);
  diagnostics.counts.depth_noise_over_calibration = depth_checks_.noise.median();
  return floor;
}

std::optional<Step> FrontEnd::process_depth(const DepthFrame& frame, SensorKind kind,
                                            Diagnostics& diagnostics) {
  if (!motion_.begin(frame.stamp)) return stamp_goes_back();
  Step step;
  const std::optional<Increment> moved = motion_.by_wheels(frame.stamp, step);
  FloorResult floor = see_floor(frame, kind, diagnostics);
  step.observations = floor.to_observations();
  {
    const auto timer = diagnostics.time("obstacles");
    step.obstacles = obstacles_.process(frame, floor, floor_.disparities());
  }
  if (!floor.look.empty()) step.ground = std::move(floor.look);
  if (!last_sight_ || frame.stamp - *last_sight_ >= kLookInterval) {
    if (DepthLook look = depth_look(frame); !look.empty()) {
      step.sight = std::move(look);
      last_sight_ = frame.stamp;
    }
  }
  motion_.move(frame, floor, moved, step, diagnostics);
  bring_to_body(floor, step);
  return step;
}

std::optional<Step> FrontEnd::process_cloud(const CloudFrame& cloud, Diagnostics& diagnostics) {
  if (cloud.points_sensor.empty()) {
    ++skipped_["cloud without points"];
    return std::nullopt;
  }
  if (!motion_.begin(cloud.stamp)) return stamp_goes_back();
  Step step;
  const std::optional<Increment> moved = motion_.by_wheels(cloud.stamp, step);
  const auto timer = diagnostics.time("floor");
  const FloorResult floor = floor_.process(cloud);
  step.observations = floor.to_observations();
  motion_.move(cloud, floor, moved, step);
  bring_to_body(floor, step);
  return step;
}

SkippedCounts FrontEnd::skipped() const {
  SkippedCounts all = skipped_;
  for (const auto& [why, count] : segments_.skipped()) all["scan: " + why] += count;
  return all;
}

}  // namespace lamina
