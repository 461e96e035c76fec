// Scans and odometry on their way.
#include <lamina/sensors/corrected_recording.hpp>

#include <cmath>
#include <cstdio>
#include <utility>

namespace lamina {

CorrectedRecording::CorrectedRecording(std::unique_ptr<Recording> source,
                                       const ScanCorrection& correction, double max_tilt,
                                       const OdometryUnits& units)
    : ForwardingRecording(std::move(source)),
      correction_(correction),
      max_tilt_(max_tilt),
      in_metres_(units) {}

bool CorrectedRecording::concerns(const SE3& T_body_lidar) const {
  const Eigen::Vector3d z_body = T_body_lidar.so3() * Eigen::Vector3d::UnitZ();
  return correction_.any() && std::abs(z_body.z()) >= std::cos(max_tilt_);
}

std::optional<Measurement> CorrectedRecording::corrected(std::optional<Measurement> measurement) {
  if (!measurement) return measurement;
  if (auto* odometry = std::get_if<Odometry>(&*measurement))
    *odometry = leaps_.add(in_metres_.of(*odometry));
  auto* scan = std::get_if<LaserScan>(&*measurement);
  if (scan && concerns(scan->lidar.T_body_lidar)) correction_.apply(*scan);
  return measurement;
}

const Calibration& CorrectedRecording::calibration() const {
  const Calibration& stated = source().calibration();
  if (!stated.lidar || !concerns(stated.lidar->T_body_lidar)) return stated;
  calibration_ = stated;
  calibration_.lidar->T_body_lidar = correction_.apply(stated.lidar->T_body_lidar);
  return calibration_;
}

std::vector<Warning> CorrectedRecording::warnings() const {
  std::vector<Warning> all = source().warnings();
  if (const double every = leaps_.counts_every(); every > 0) {
    char steps[200];
    std::snprintf(steps, sizeof steps,
                  "the odometry counts every %.2f s though it is written more often: within that, "
                  "it does not say where the robot was",
                  every);
    all.push_back({"odometry_steps", steps});
  }
  const auto& leaps = leaps_.leaps();
  if (leaps.empty()) return all;
  const OdometryLeaps::Leap& first = leaps.front();
  char text[400];
  std::snprintf(
      text, sizeof text,
      "the odometry leaps by %.2f m and %.0f deg at %s%s%s: far beyond its speeds before, "
      "so no motion; the robot is taken to have gone on at its speed, corrected by what "
      "its sensors see",
      first.metres, first.radians * 180 / M_PI, first.stamp.to_string().c_str(),
      first.to_origin ? " (its counter begins at zero again)" : "",
      leaps.size() > 1 ? (", the first of " + std::to_string(leaps.size()) + " leaps").c_str()
                       : "");
  all.push_back({"odometry_leap", text});
  return all;
}

}  // namespace lamina
