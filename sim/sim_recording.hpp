// A simulated robot as a Recording: measurements in time order, with their truth.
#pragma once

#include <cstdint>
#include <memory>

#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sim/world.hpp>

namespace lamina::sim {

/// Drives a World's robot along its path and measures. The same world and seed give the same
/// measurements. Every frame carries the calibration the robot believes.
class Simulation final : public Recording {
 public:
  Simulation(World world, std::uint64_t seed);
  ~Simulation() override;

  std::optional<Measurement> next() override;
  const Calibration& calibration() const override { return assumed_; }
  SkippedCounts skipped() const override { return {}; }
  std::optional<std::int64_t> size_hint() const override;

  const World& world() const { return world_; }
  const Caster& caster() const { return *caster_; }
  /// True T_map_body at a time.
  SE3 pose_at(Timestamp stamp) const;
  /// True poses at every stamp there is a measurement for, so far.
  const Trajectory& truth() const { return truth_; }
  /// Exact image behind the last DepthFrame given; empty before the first.
  const DepthTruth& depth_truth() const { return depth_truth_; }
  /// Exact scan behind the last LaserScan given.
  const ScanTruth& scan_truth() const { return scan_truth_; }
  /// How many measurements (pixels and beams) hit each plane of the scene, so far.
  const std::vector<std::int64_t>& hits() const { return hits_; }
  /// In how many frames and scans each plane was seen at all (at least 3 pixels or beams).
  const std::vector<std::int64_t>& sightings() const { return sightings_; }

 private:
  enum Stream { kOdometry, kAccelerometer, kLidar, kDepth, kStereo, kStreams };
  struct Renderers;
  double time_of(Stream stream, std::int64_t index) const;
  /// What its measurements are stamped with.
  double stamped_time_of(Stream stream, std::int64_t index) const;
  Timestamp stamp_at(double time) const;
  /// `valid(i)`: whether pixel or beam i gave a measurement.
  template <class Valid>
  void count_hits(const std::vector<std::int32_t>& surfaces, const Valid& valid);
  ScanTruth swept(const LidarSensor& sensor, double time) const;
  Measurement measure(Stream stream, std::int64_t index, double time, Timestamp stamp);
  Measurement accelerate(Timestamp stamp, std::int64_t index, double time) const;

  World world_;
  std::uint64_t seed_;
  std::unique_ptr<Caster> caster_;
  std::unique_ptr<Renderers> renderers_;
  Calibration assumed_;
  double rates_[kStreams] = {}, delays_[kStreams] = {};
  std::int64_t next_[kStreams] = {};
  Trajectory truth_;
  DepthTruth depth_truth_;
  ScanTruth scan_truth_;
  std::vector<std::int64_t> hits_, sightings_;
};

}  // namespace lamina::sim
