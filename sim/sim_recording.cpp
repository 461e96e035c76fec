// Merges the simulated streams by time.
#include <lamina/sim/sim_recording.hpp>

#include <cmath>

#include <lamina/sim/stereo.hpp>

namespace lamina::sim {

struct Simulation::Renderers {
  std::optional<DepthRenderer> depth;
  std::optional<StereoRenderer> stereo;
  std::optional<LidarSimulator> lidar;
  std::optional<OdometrySimulator> odometry;
};

Simulation::Simulation(World world, std::uint64_t seed)
    : world_(std::move(world)),
      seed_(seed),
      caster_(std::make_unique<Caster>(world_.scene)),
      renderers_(std::make_unique<Renderers>()),
      assumed_(world_.rig.accepted()),
      hits_(world_.scene.planes().size()),
      sightings_(world_.scene.planes().size()) {
  const Rig& rig = world_.rig;
  if (rig.odometry) {
    rates_[kOdometry] = rig.odometry->rate_hz;
    renderers_->odometry.emplace(rig.odometry->errors, seed);
  }
  if (rig.accelerometer) {
    rates_[kAccelerometer] = rig.accelerometer->rate_hz;
  }
  if (rig.lidar) {
    rates_[kLidar] = rig.lidar->rate_hz;
    delays_[kLidar] = rig.lidar->delay_s;
    renderers_->lidar.emplace(*caster_, rig.lidar->model, rig.lidar->geometry, rig.lidar->effects,
                              seed);
  }
  if (rig.depth) {
    rates_[kDepth] = rig.depth->rate_hz;
    delays_[kDepth] = rig.depth->delay_s;
    renderers_->depth.emplace(*caster_, rig.depth->camera, rig.depth->effects, seed);
  }
  if (rig.stereo) {
    rates_[kStereo] = rig.stereo->rate_hz;
    renderers_->stereo.emplace(*caster_, rig.stereo->camera, rig.stereo->pixel_noise, seed);
  }
}

Simulation::~Simulation() = default;

double Simulation::time_of(Stream stream, std::int64_t index) const {
  return static_cast<double>(index) / rates_[stream];
}

double Simulation::stamped_time_of(Stream stream, std::int64_t index) const {
  return time_of(stream, index) + delays_[stream];
}

Timestamp Simulation::stamp_at(double time) const {
  // Whole microseconds: six decimals in every text file say the stamp exactly.
  return Timestamp::from_nanoseconds(
      1000 * static_cast<std::int64_t>(std::floor((world_.start_time + time) * 1e6 + 0.5)));
}

SE3 Simulation::pose_at(Timestamp stamp) const {
  return world_.path.at(stamp.seconds() - world_.start_time);
}

std::optional<std::int64_t> Simulation::size_hint() const {
  std::int64_t sum = 0;
  for (double rate : rates_) {
    sum += rate > 0
               ? static_cast<std::int64_t>(std::floor(world_.path.duration() * rate + 1e-9)) + 1
               : 0;
  }
  return sum;
}

std::optional<Measurement> Simulation::next() {
  int best = -1;
  for (int s = 0; s < kStreams; ++s) {
    if (rates_[s] > 0 &&
        time_of(static_cast<Stream>(s), next_[s]) <= world_.path.duration() + 1e-9 / rates_[s] &&
        (best < 0 || stamped_time_of(static_cast<Stream>(s), next_[s]) <
                         stamped_time_of(static_cast<Stream>(best), next_[best]) - 1e-9)) {
      best = s;
    }
  }
  if (best < 0) {
    return std::nullopt;
  }
  const Stream stream = static_cast<Stream>(best);
  const std::int64_t index = next_[best]++;
  const double time = time_of(stream, index);
  const double stamped = stamped_time_of(stream, index);
  truth_.add(stamp_at(stamped), world_.path.at(stamped));
  return measure(stream, index, time, stamp_at(stamped));
}

template <class Valid>
void Simulation::count_hits(const std::vector<std::int32_t>& surfaces, const Valid& valid) {
  std::vector<std::int64_t> here(hits_.size());
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const int plane = caster_->plane_of(surfaces[i]);
    if (plane >= 0 && valid(i)) {
      ++here[static_cast<std::size_t>(plane)];
    }
  }
  for (std::size_t i = 0; i < here.size(); ++i) {
    hits_[i] += here[i];
    sightings_[i] += here[i] >= 3 ? 1 : 0;
  }
}

Measurement Simulation::accelerate(Timestamp stamp, std::int64_t index, double time) const {
  // Second difference over 0.1 s: the path's corners are not infinitely sharp.
  constexpr double kStep = 0.1;
  const Path& path = world_.path;
  const Eigen::Vector3d acceleration_map =
      (path.at(time + kStep).translation() - 2 * path.at(time).translation() +
       path.at(time - kStep).translation()) /
      (kStep * kStep);
  Accelerometer out;
  out.stamp = stamp;
  out.acceleration_body =
      path.at(time).so3().inverse() * (acceleration_map + Eigen::Vector3d(0, 0, 9.81));
  Random random(seed_, 0xACCE1000000000ULL + static_cast<std::uint64_t>(index));
  for (int k = 0; k < 3; ++k) {
    out.acceleration_body[k] += world_.rig.accelerometer->sigma * random.normal();
  }
  return out;
}

// What is along the beams of a scan, each at its time.
ScanTruth Simulation::swept(const LidarSensor& sensor, double time) const {
  const SE3& T_body_lidar = sensor.model.T_body_lidar;
  if (sensor.sweep_s == 0) return renderers_->lidar->truth(world_.path.at(time) * T_body_lidar);
  constexpr int kPieces = 64;
  std::vector<SE3> poses;
  for (int k = 0; k < kPieces; ++k) {
    const double at = time + (k + 0.5) / kPieces * sensor.sweep_s;
    poses.push_back(world_.path.at(at) * T_body_lidar);
  }
  return renderers_->lidar->truth(poses);
}

Measurement Simulation::measure(Stream stream, std::int64_t index, double time, Timestamp stamp) {
  const SE3 T_map_body = world_.path.at(time);
  const std::uint64_t frame = static_cast<std::uint64_t>(index);
  switch (stream) {
    case kOdometry:
      return renderers_->odometry->step(stamp, time, T_map_body);
    case kAccelerometer:
      return accelerate(stamp, index, time);
    case kLidar: {
      const SE3 T_map_lidar = T_map_body * world_.rig.lidar->model.T_body_lidar;
      scan_truth_ = swept(*world_.rig.lidar, time);
      LaserScan scan = renderers_->lidar->measure(scan_truth_, T_map_lidar, stamp, frame);
      count_hits(scan_truth_.surfaces, [&](std::size_t i) { return scan.valid(i); });
      scan.lidar = *assumed_.lidar;
      return scan;
    }
    case kStereo: {
      const SE3 T_map_camera = T_map_body * world_.rig.stereo->camera.camera.T_body_camera;
      depth_truth_ = renderers_->stereo->truth(T_map_camera);
      count_hits(depth_truth_.surface, [](std::size_t) { return true; });
      StereoFrame pair = renderers_->stereo->measure(depth_truth_, T_map_camera, stamp, frame);
      pair.camera = *assumed_.stereo_camera;
      return pair;
    }
    default: {
      const SE3 T_map_camera = T_map_body * world_.rig.depth->camera.camera.T_body_camera;
      depth_truth_ = renderers_->depth->truth(T_map_camera);
      DepthFrame image = renderers_->depth->measure(depth_truth_, T_map_camera, stamp, frame);
      count_hits(depth_truth_.surface, [&](std::size_t i) { return image.raw[i] > 0; });
      image.camera = *assumed_.depth_camera;
      return image;
    }
  }
}

}  // namespace lamina::sim
