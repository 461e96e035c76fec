// What is stated, what wheels tell, and what is left of both.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/apps/mounting_doubt.hpp>

namespace lamina::apps {
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

TEST(MountingDoubt, IsWhatIsStatedAboutTheSensorsPlace) {
  Settings settings;
  settings.mounting_sigma_heading_deg = 1;
  settings.mounting_sigma_place_m = 0.02;
  MountingDoubt doubt(settings);
  doubt.met(seen_from(2, 0), true);
  const Eigen::Matrix3d C = doubt.covariance();
  EXPECT_NEAR(std::sqrt(C(2, 2)), kDegree, 1e-9);
  EXPECT_NEAR(std::sqrt(C(0, 0)), 0.02, 1e-9);
  // Turned about a point 2 m ahead: the body's origin goes aside.
  EXPECT_NEAR(C(1, 1), 0.02 * 0.02 + std::pow(2 * kDegree, 2), 1e-9);
  EXPECT_NEAR(C(1, 2), -2 * kDegree * kDegree, 1e-9);
}

TEST(MountingDoubt, NobodySaidWhereASensorInTheMiddleSits) {
  MountingDoubt doubt{Settings()};
  doubt.met(seen_from(0, 0), true);
  EXPECT_LT(doubt.covariance()(0, 0), 1e-9);
  EXPECT_GT(doubt.covariance()(2, 2), 1e-4);
  doubt.met(seen_from(0, 0), false);  // no wheels: poses are its own
  EXPECT_LT(doubt.covariance()(2, 2), 1e-9);
}

TEST(MountingDoubt, CountsWhatWasToldAndNotCorrected) {
  Settings settings;
  settings.mounting_sigma_heading_deg = 1;
  MountingDoubt doubt(settings);
  doubt.met(seen_from(0.3, 0.1, true), true);
  doubt.met(seen_from(0, 0), true);  // a camera: the scanner counts
  EXPECT_GT(doubt.covariance()(0, 0), 1e-4);
  MountingEvidence told;
  told.information(2, 2) = 1 / std::pow(0.5 * kDegree, 2);
  told.pull(2) = told.information(2, 2) * 0.4 * kDegree;
  doubt.hear(told);
  // 1 and 0.5 degrees put together: 0.32 +- 0.45.
  EXPECT_NEAR(doubt.covariance()(2, 2), (0.2 + 0.32 * 0.32) * kDegree * kDegree, 1e-7);
}

// A fan across the way sees nothing of how far the robot goes; images and level scans do.
TEST(MountingDoubt, BesideAFanAcrossTheWayWheelsAreAlone) {
  Step fan = seen_from(0, 0.1, true);
  fan.scan_motion.reset();
  fan.observations.sensor = SensorKind::kLidar;
  Step image;
  image.observations.sensor = SensorKind::kDepth;
  const auto alone = [](const std::vector<Step>& steps, bool wheels) {
    MountingDoubt doubt{Settings()};
    for (const Step& step : steps) doubt.met(step, wheels);
    return doubt.wheels_alone();
  };
  EXPECT_TRUE(alone({fan, fan}, true));
  EXPECT_FALSE(alone({fan}, false));
  EXPECT_FALSE(alone({fan, image}, true));
  EXPECT_FALSE(alone({fan, seen_from(0.3, 0, true)}, true));
  EXPECT_FALSE(alone({seen_from(0.3, 0, true)}, true));
}

}  // namespace
}  // namespace lamina::apps
