// Scans as of one instant: what the body did while the beam went round taken out.
#include <algorithm>
#include <cmath>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/motion/deskew.hpp>
#include <lamina/frontend/segments/ground_returns.hpp>

namespace lamina {

// s from the first beam to the last.
double FrontEnd::sweep_of(const LaserScan& scan) const {
  const double beams = static_cast<double>(std::max<std::size_t>(scan.size(), 2) - 1);
  return scan.time_increment > 0 ? scan.time_increment * beams : sweep_;
}

std::optional<Vector6d> FrontEnd::wheels_in(const LaserScan& scan, double sweep) const {
  const Timestamp other = scan.stamp + sweep;
  const WheelTrack& wheels = wheels_ahead_.empty() ? wheels_ : wheels_ahead_;
  return wheels.velocity(std::min(scan.stamp, other), std::max(scan.stamp, other));
}

std::optional<Vector6d> FrontEnd::last_velocity() const {
  if (!(scan_interval_ > 0)) return std::nullopt;
  return Vector6d(scan_step_.log() / scan_interval_);
}

// The velocity that a scan without wheels tells by its own motion, where the scan was straightened
// by another. (By the last one's throughout, an error would come back with the other sign, scan
// after scan.)
std::optional<Vector6d> FrontEnd::other_velocity(double dt, double sweep, const ScanMotion& motion,
                                                 const std::optional<Vector6d>& used) const {
  constexpr double kMetres = 0.002, kRadians = 0.001;  // over the sweep
  if (motion.status == ScanMotion::Status::kPredicted || !(dt > 0)) return std::nullopt;
  const Vector6d velocity = motion.T_prev_curr_body.log() / dt;
  const Vector6d off = sweep * (velocity - used.value_or(Vector6d::Zero()));
  if (off.head<3>().norm() < kMetres && off.tail<3>().norm() < kRadians) return std::nullopt;
  return velocity;
}

// Once the sweep is found, scans are straightened from the next one on.
void FrontEnd::watch_sweep(const LaserScan& measured, const std::optional<Increment>& wheels,
                           const ScanMotion& motion, Diagnostics& metrics) {
  if (!sweep_watch_ || sweep_watch_->done() || measured.time_increment > 0) return;
  const auto timer = metrics.time("scanner_sweep");
  std::optional<SE3> moved;
  bool finely = false;
  if (wheels) {
    moved = wheels->T_from_to;
    finely = last_scan_ && wheels_.several_within(*last_scan_, measured.stamp);
  } else if (last_scan_ && motion.status == ScanMotion::Status::kTracked) {
    moved = motion.T_prev_curr_body;
  }
  sweep_watch_->add(measured, moved, finely);
  const auto found = sweep_watch_->found_on_the_way();
  if (!found) return;
  found_sweep_ = found;
  sweep_ = found->sweep;
}

// With the noise that scans tell of themselves.
LaserScan FrontEnd::as_noisy_as_it_is(const LaserScan& measured) {
  LaserScan scan = measured;
  range_check_.add(measured);
  scan.range_max = range_check_.range_max(measured);
  scan.lidar.noise.range_sigma = range_noise_.update(scan);
  if (scan.lidar.noise.range_sigma > measured.lidar.noise.range_sigma)
    scanner_noise_ = std::max(scanner_noise_, scan.lidar.noise.range_sigma);
  return scan;
}

// The scan as the front-ends take it; returns from the ground are left out, and counted.
LaserScan FrontEnd::prepared(const LaserScan& measured, bool level, double sweep,
                             const std::optional<Vector6d>& velocity, std::int64_t& ground) const {
  const double beams = static_cast<double>(std::max<std::size_t>(measured.size(), 2) - 1);
  LaserScan scan = velocity ? straightened(measured, sweep / beams, *velocity) : measured;
  if (level) scan.lidar.T_body_lidar = level_scanner_.apply(scan.lidar.T_body_lidar);
  ground = level && planar_ ? remove_ground(scan) : 0;
  return scan;
}

}  // namespace lamina
