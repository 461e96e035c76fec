// What is written of a calibration is read again as it was.
#include <gtest/gtest.h>

#include <lamina/pipeline/calibration/calibration_found.hpp>
#include <lamina/pipeline/calibration/calibration_report.hpp>

namespace lamina {
namespace {

Calibration all_sensors() {
  Calibration stated;
  stated.depth_camera.emplace();
  CameraModel& camera = stated.depth_camera->camera;
  camera = {320, 240, 262.5, 262.5, 159.5, 119.5, {}, forward_looking_camera()};
  stated.depth_camera->noise = DepthNoise::kinect(262.5);
  stated.lidar.emplace().T_body_lidar = SE3::planar(0.2, 0.1, 0.4);
  stated.odometry.sigma_translation = 0.03;
  return stated;
}

TEST(CalibrationFound, IsReadAgain) {
  Diagnostics metrics;
  report({"depth_camera.fx_px", 262.5, 257.25, 0.5, {12, 100, 4, true}, 13}, metrics);
  report({"lidar.sweep_s", 0, 0.02, 0.01, {12, 3, 0.4, false}}, metrics);
  Step scan;
  scan.scan.emplace();
  scan.scan_motion.emplace();
  scan.observations.T_body_sensor = SE3::planar(0.2, 0.1, 0.45);
  MountingsUsed mountings;
  mountings.add(scan);
  const std::string text = calibration_found(mountings.over(all_sensors()), metrics);
  EXPECT_NE(text.find("# depth_camera.fx_px: 262.5 stated, 257.25 found, +- 0.5"),
            std::string::npos);
  EXPECT_EQ(text.find("sweep"), std::string::npos);
  const Calibration again = parse_calibration(text, "calibration_found.yaml");
  EXPECT_NEAR(again.depth_camera->camera.fx, 257.25, 1e-6);
  EXPECT_NEAR(again.lidar->T_body_lidar.so3().yaw(), 0.45, 1e-7);
  EXPECT_EQ(again.odometry.sigma_translation, 0.03);
  EXPECT_LT(
      (again.depth_camera->camera.T_body_camera.inverse() * forward_looking_camera()).log().norm(),
      1e-7);
}

TEST(CalibrationReport, BeyondItsBoundItIsAWarningAndNotAdopted) {
  Diagnostics metrics;
  EXPECT_FALSE(report({"depth_camera.fx_px", 262.5, 294, 1, {12, 100, 4, true}, 13}, metrics,
                      "focal_length", "not corrected"));
  ASSERT_EQ(metrics.warnings.size(), 1);
  EXPECT_EQ(metrics.warnings[0].id, "focal_length");
  ASSERT_EQ(metrics.calibration.size(), 1);
  EXPECT_FALSE(metrics.calibration[0].adopted);
}

// Of a short recording blocks are too few to adopt anything.
TEST(CalibrationReport, ClearlyBeyondItsBoundItIsSaidHoweverShortTheRecording) {
  for (const double found : {136.0, 141.0}) {
    Diagnostics metrics;
    EXPECT_FALSE(report({"depth_camera.fx_px", 146, found, 0.8, {6, 47, 3, false}, 7.3}, metrics,
                        "focal_length", "not corrected"));
    EXPECT_EQ(metrics.warnings.size(), found < 137 ? 1 : 0);
  }
}

}  // namespace
}  // namespace lamina
