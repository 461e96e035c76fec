// A prior and evidence, put together.
#include <lamina/pipeline/calibration/extrinsics_uncertainty.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/pipeline/calibration/calibration_priors.hpp>
#include <lamina/pipeline/calibration/log.hpp>

namespace lamina {
namespace {

constexpr double kMiddle = 0.001;  // m
constexpr double kCertain = 1e-6;  // m or rad, in place of none

}  // namespace

ExtrinsicsUncertainty::ExtrinsicsUncertainty(const CalibrationOptions& settings)
    : sigma_heading_(std::max(kCertain, settings.mounting_sigma_heading_deg * M_PI / 180)),
      sigma_place_(std::max(kCertain, settings.mounting_sigma_place_m)) {}

void ExtrinsicsUncertainty::update(const MountingEvidence& evidence) {
  evidence_.information += evidence.information;
  evidence_.pull += evidence.pull;
}

void ExtrinsicsUncertainty::met(const Step& step, bool wheels) {
  wheels_ = wheels;
  const bool level_scanner = step.scan && step.scan_motion;
  const SensorKind sensor = step.observations.sensor;
  const bool image = !step.scan && (sensor == SensorKind::kDepth || sensor == SensorKind::kStereo ||
                                    sensor == SensorKind::kCloud);
  fans_ = fans_ || (step.scan && !step.scan_motion);
  others_ = others_ || level_scanner || image;
  if (level_scanner_ && !level_scanner) return;
  level_scanner_ = level_scanner;
  place_body_ = step.observations.T_body_sensor.translation().head<2>();
}

Eigen::Matrix3d ExtrinsicsUncertainty::covariance() const {
  const bool middle = place_body_.norm() < kMiddle;
  const double place = middle ? kCertain : sigma_place_;
  const double heading = middle && !wheels_ ? kCertain : sigma_heading_;
  // From e to the error of the sensor's own place: it turns about that.
  Eigen::Matrix3d to_sensor = Eigen::Matrix3d::Identity();
  to_sensor.topRightCorner<2, 1>() = Eigen::Vector2d(-place_body_.y(), place_body_.x());
  const Eigen::Vector3d prior(1 / (place * place), 1 / (place * place), 1 / (heading * heading));
  const Eigen::LLT<Eigen::Matrix3d> H(
      Eigen::Matrix3d(to_sensor.transpose() * prior.asDiagonal() * to_sensor) +
      evidence_.information);
  const Eigen::Vector3d left = H.solve(evidence_.pull);
  return Eigen::Matrix3d(H.solve(Eigen::Matrix3d::Identity())) + left * left.transpose();
}

void ExtrinsicsUncertainty::tell(Mapper& mapper, Diagnostics& metrics) const {
  const Eigen::Matrix3d C = covariance();
  mapper.set_extrinsics_covariance(C);
  const double heading_deg = std::sqrt(C(2, 2)) * 180 / M_PI;
  const double place_cm = 100 * std::sqrt(0.5 * (C(0, 0) + C(1, 1)));
  // A place that nothing states, or a heading that nothing could tell, is not known to 0.0.
  const bool place_known = place_body_.norm() >= kMiddle;
  const bool heading_known = place_known || wheels_;
  run_log().info("sensor mounting: heading {}, position {}",
                 heading_known ? fmt::format("known to +-{:.2f} deg", heading_deg) : "assumed",
                 place_known ? fmt::format("known to +-{:.1f} cm", place_cm) : "assumed");
  if (heading_known) metrics.counts.mounting_heading_sigma_deg = heading_deg;
  if (place_known) metrics.counts.mounting_place_sigma_cm = place_cm;
  if (!wheels_alone()) return;
  const WheelErrors::Matrix prior = WheelPrior(Eigen::Vector2d::Zero()).information();
  const Eigen::Vector3d of_wheels = prior.diagonal().head<3>();
  mapper.set_wheel_covariance(of_wheels.cwiseInverse().asDiagonal());
  const auto sigma = mapper.path_sigma();
  const double path = mapper.trajectory().length();
  metrics.counts.by_wheels_alone_m = metrics.counts.way_by_wheels_alone_m = path;
  metrics.counts.heading_by_wheels_alone_m = 0;  // walls hold it along themselves
  if (sigma) metrics.counts.by_wheels_alone_sigma_m = *sigma;
}

}  // namespace lamina
