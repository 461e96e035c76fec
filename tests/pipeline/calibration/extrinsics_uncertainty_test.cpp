// What is stated, what wheels tell, and what is left of both.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/pipeline/calibration/extrinsics_uncertainty.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

Step seen_from(double x, double y, bool level_scanner = false) {
  Step step;
  step.observations.T_body_sensor = SE3(SO3(), {x, y, 1});
  if (level_scanner) {
    step.scan.emplace();
    step.scan_motion.emplace();
  }
  return step;
}

TEST(ExtrinsicsUncertainty, IsWhatIsStatedAboutTheSensorsPlace) {
  CalibrationOptions settings;
  settings.mounting_sigma_heading_deg = 1;
  settings.mounting_sigma_place_m = 0.02;
  ExtrinsicsUncertainty uncertainty(settings);
  uncertainty.met(seen_from(2, 0), true);
  const Eigen::Matrix3d C = uncertainty.covariance();
  EXPECT_NEAR(std::sqrt(C(2, 2)), kDegree, 1e-9);
  EXPECT_NEAR(std::sqrt(C(0, 0)), 0.02, 1e-9);
  // Turned about a point 2 m ahead: the body's origin goes aside.
  EXPECT_NEAR(C(1, 1), 0.02 * 0.02 + std::pow(2 * kDegree, 2), 1e-9);
  EXPECT_NEAR(C(1, 2), -2 * kDegree * kDegree, 1e-9);
}

TEST(ExtrinsicsUncertainty, NobodySaidWhereASensorInTheMiddleSits) {
  ExtrinsicsUncertainty uncertainty{CalibrationOptions()};
  uncertainty.met(seen_from(0, 0), true);
  EXPECT_LT(uncertainty.covariance()(0, 0), 1e-9);
  EXPECT_GT(uncertainty.covariance()(2, 2), 1e-4);
  uncertainty.met(seen_from(0, 0), false);  // no wheels: poses are its own
  EXPECT_LT(uncertainty.covariance()(2, 2), 1e-9);
}

TEST(ExtrinsicsUncertainty, CountsWhatWasToldAndNotCorrected) {
  CalibrationOptions settings;
  settings.mounting_sigma_heading_deg = 1;
  ExtrinsicsUncertainty uncertainty(settings);
  uncertainty.met(seen_from(0.3, 0.1, true), true);
  uncertainty.met(seen_from(0, 0), true);  // a camera: the scanner counts
  EXPECT_GT(uncertainty.covariance()(0, 0), 1e-4);
  MountingEvidence observed;
  observed.information(2, 2) = 1 / std::pow(0.5 * kDegree, 2);
  observed.pull(2) = observed.information(2, 2) * 0.4 * kDegree;
  uncertainty.update(observed);
  // 1 and 0.5 degrees put together: 0.32 +- 0.45.
  EXPECT_NEAR(uncertainty.covariance()(2, 2), (0.2 + 0.32 * 0.32) * kDegree * kDegree, 1e-7);
}

// A fan across the way sees nothing of how far the robot goes; images and level scans do.
TEST(ExtrinsicsUncertainty, BesideAFanAcrossTheWayWheelsAreAlone) {
  Step fan = seen_from(0, 0.1, true);
  fan.scan_motion.reset();
  fan.observations.sensor = SensorKind::kLidar;
  Step image;
  image.observations.sensor = SensorKind::kDepth;
  const auto alone = [](const std::vector<Step>& steps, bool wheels) {
    ExtrinsicsUncertainty uncertainty{CalibrationOptions()};
    for (const Step& step : steps) uncertainty.met(step, wheels);
    return uncertainty.wheels_alone();
  };
  EXPECT_TRUE(alone({fan, fan}, true));
  EXPECT_FALSE(alone({fan}, false));
  EXPECT_FALSE(alone({fan, image}, true));
  EXPECT_FALSE(alone({fan, seen_from(0.3, 0, true)}, true));
  EXPECT_FALSE(alone({seen_from(0.3, 0, true)}, true));
}

}  // namespace
}  // namespace lamina
