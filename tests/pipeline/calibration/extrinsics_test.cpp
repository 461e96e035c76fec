// What follows from a mounting that was wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <lamina/pipeline/calibration/extrinsics.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
const SE3 kMounted(SO3::rot_z(0.4), {0.3, 0.1, 0.2});

// Pillars of several sizes about a place.
std::vector<testing::Wall> pillars_near(const Eigen::Vector3d& place) {
  std::vector<testing::Wall> walls;
  constexpr double kApart = 2.3;
  const int x0 = static_cast<int>(std::lround(place.x() / kApart));
  const int y0 = static_cast<int>(std::lround(place.y() / kApart));
  for (int x = x0 - 2; x <= x0 + 2; ++x) {
    for (int y = y0 - 2; y <= y0 + 2; ++y) {
      const double half = 0.3 + 0.1 * std::sin(3.0 * x + 5.0 * y);
      const Eigen::Vector2d c(kApart * x + 0.4 * std::sin(7.0 * y), kApart * y + 0.3 * (x % 3));
      const Eigen::Vector2d u(half, half), v(half, -half);
      walls.insert(walls.end(), {{c + u, c + v}, {c + v, c - u}, {c - u, c - v}, {c - v, c + u}});
    }
  }
  return walls;
}

// Scans along a curve and a step of the wheels alone after each, as a scanner mounted at `T_true`
// and said to be at `T_said` has them.
std::vector<Step> drive(const SE3& T_said, std::size_t scans,
                        SensorKind between = SensorKind::kLidar, std::optional<double> turn = {},
                        const SE3& T_true = kMounted) {
  const SE3 D = T_said * T_true.inverse();  // of the frame of the body that scans believe in
  testing::Scanner scanner;
  scanner.sigma = 0;
  scanner.beams = 181;
  scanner.T_body_lidar = T_true;
  SE3 T_world_body;
  std::vector<Step> steps;
  for (std::size_t i = 0; i < scans; ++i) {
    const double way_round[] = {0, 1, -1};
    const SE3 moved = SE3::planar(0.1, 0, turn ? *turn * way_round[i / 10 % 3] : 0.01);
    if (i > 0) T_world_body = T_world_body * moved;
    Step step;
    step.scan = scanner.scan(pillars_near(T_world_body.translation()), T_world_body,
                             0.2 * static_cast<double>(i));
    step.scan->lidar.T_body_lidar = T_said;
    step.observations.T_body_sensor = T_said;
    step.motion.T_from_to = i == 0 ? SE3::planar(5, 6, 1) : D * moved * D.inverse();
    if (i > 0) step.motion.T_from_to = SE3::planar(0.05, 0, 0).inverse() * step.motion.T_from_to;
    step.scan_motion.emplace().T_prev_curr_body = D * moved * D.inverse();
    step.scan_motion->status = ScanMotion::Status::kTracked;
    if (i > 0) step.wheels_moved = moved;
    steps.push_back(step);
    Step image;
    image.observations.sensor = between;
    image.observations.obstacle_points_body = {{1, 0, 0}};
    image.motion.T_from_to = SE3::planar(0.05, 0, 0);
    steps.push_back(image);
  }
  return steps;
}

SE3 last_scan(const std::vector<Step>& steps) {
  SE3 T;
  for (std::size_t i = 0; i + 1 < steps.size(); ++i) T = T * steps[i].motion.T_from_to;
  return T;
}

TEST(MountingCalibration, AHeadingTurnsPathLoopsAndScans) {
  const MountingCorrection error{{0, 0, 3 * kDegree}, Eigen::Vector3d::Zero()};
  std::vector<Step> steps = drive(error.apply(kMounted), 200), right = drive(kMounted, 200);
  const SE3 D = error.apply(kMounted) * kMounted.inverse();
  const SE3 between = SE3::planar(1, 2, 0.5);
  std::vector<LoopClosure> loops(1);
  loops[0].T_from_to = D * between * D.inverse();
  const SE3 wrong_end = last_scan(steps);
  const auto corrected = calibrate_mountings(steps, loops, true).corrected;
  ASSERT_EQ(corrected.size(), 1);
  EXPECT_EQ(corrected[0].sensor, "scanner");
  EXPECT_NEAR(corrected[0].correction.rotation_body.z(), -3 * kDegree, 0.05 * kDegree);
  const SE3 end = last_scan(right);
  EXPECT_GT((wrong_end.translation() - end.translation()).norm(), 0.5);
  EXPECT_LT((last_scan(steps).translation() - end.translation()).norm(), 0.02);
  EXPECT_LT((loops[0].T_from_to.translation() - between.translation()).norm(), 0.005);
  EXPECT_NEAR(steps[4].scan->lidar.T_body_lidar.so3().yaw(), 0.4, 0.05 * kDegree);
  EXPECT_NEAR(steps[4].observations.T_body_sensor.so3().yaw(), 0.4, 0.05 * kDegree);
  // What is the wheels' alone stays, and so does the first pose.
  EXPECT_LT((steps[5].motion.T_from_to.translation() - Eigen::Vector3d(0.05, 0, 0)).norm(), 1e-9);
  EXPECT_EQ(steps[0].motion.T_from_to.translation(), Eigen::Vector3d(5, 6, 0));
}

TEST(MountingCalibration, APlaceToldByTurnsMovesPathLoopsAndScans) {
  const MountingCorrection error{Eigen::Vector3d::Zero(), {0.06, -0.03, 0}};
  std::vector<Step> steps = drive(error.apply(kMounted), 200, SensorKind::kLidar, 0.1);
  const std::vector<Step> right = drive(kMounted, 200, SensorKind::kLidar, 0.1);
  const SE3 D = error.apply(kMounted) * kMounted.inverse();
  const SE3 between = SE3::planar(1, 2, 2);
  std::vector<LoopClosure> loops(1);
  loops[0].T_from_to = D * between * D.inverse();
  const auto corrected = calibrate_mountings(steps, loops, true).corrected;
  ASSERT_EQ(corrected.size(), 1);
  EXPECT_EQ(corrected[0].source, "turns");
  EXPECT_LT((corrected[0].correction.translation_body + error.translation_body).norm(), 0.001);
  EXPECT_LT((last_scan(steps).translation() - last_scan(right).translation()).norm(), 0.002);
  EXPECT_LT((loops[0].T_from_to.translation() - between.translation()).norm(), 0.002);
  EXPECT_LT((steps[4].scan->lidar.T_body_lidar.translation() - kMounted.translation()).norm(),
            0.001);
  // Nobody said where a scanner sits that is said to sit in the middle.
  std::vector<Step> unstated =
      drive(SE3(), 200, SensorKind::kLidar, 0.1, SE3(SO3(), {0.02, -0.01, 0}));
  std::vector<CorrectedMounting> of_unstated = calibrate_mountings(unstated, loops, true).corrected;
  EXPECT_TRUE(std::none_of(of_unstated.begin(), of_unstated.end(),
                           [](const CorrectedMounting& c) { return c.source == "turns"; }));
}

// Beyond what mountings are measured to a place is a contradiction: said, and corrected where
// what was left out confirms it.
TEST(MountingCalibration, APlaceFarOffIsAContradiction) {
  const MountingCorrection far{Eigen::Vector3d::Zero(), {0.6, -0.3, 0}};
  std::vector<Step> steps = drive(far.apply(kMounted), 200, SensorKind::kLidar, 0.1);
  const std::vector<Step> right = drive(kMounted, 200, SensorKind::kLidar, 0.1);
  std::vector<LoopClosure> loops;
  const auto contradiction = calibrate_mountings(steps, loops, true).contradiction;
  ASSERT_TRUE(contradiction);
  EXPECT_TRUE(contradiction->corrected);
  EXPECT_LT((contradiction->stated - Eigen::Vector2d(0.9, -0.2)).norm(), 1e-9);
  EXPECT_LT((contradiction->found - Eigen::Vector2d(0.3, 0.1)).norm(), 0.01);
  EXPECT_LT((last_scan(steps).translation() - last_scan(right).translation()).norm(), 0.01);
  std::vector<Step> in_order = drive(kMounted, 200, SensorKind::kLidar, 0.1);
  EXPECT_FALSE(calibrate_mountings(in_order, loops, true).contradiction);
}

// Five centimetres along both axes are a mounting measured badly.
TEST(MountingCalibration, APlaceOffByCentimetresAlongBothAxesIsCorrected) {
  const MountingCorrection error{Eigen::Vector3d::Zero(), {0.05, -0.05, 0}};
  std::vector<Step> steps = drive(error.apply(kMounted), 200, SensorKind::kLidar, 0.1);
  std::vector<LoopClosure> loops;
  ASSERT_EQ(calibrate_mountings(steps, loops, true).corrected.size(), 1);
  EXPECT_LT((steps[4].scan->lidar.T_body_lidar.translation() - kMounted.translation()).norm(),
            0.005);
}

// Wheels turn about a point that tyres, load and slip move by as much: a place measured by hand is
// no worse than that.
TEST(MountingCalibration, APlaceWithinWhatWheelsTellStays) {
  const MountingCorrection error{Eigen::Vector3d::Zero(), {0.035, -0.01, 0}};
  std::vector<Step> steps = drive(error.apply(kMounted), 200, SensorKind::kLidar, 0.1);
  std::vector<LoopClosure> loops;
  const auto found = calibrate_mountings(steps, loops, true);
  EXPECT_TRUE(found.corrected.empty());
  EXPECT_GT(found.left.information(0, 0), 0);
}

TEST(MountingCalibration, WhatIsInOrderStays) {
  std::vector<Step> steps = drive(kMounted, 200);
  std::vector<LoopClosure> loops;
  const SE3 end = last_scan(steps);
  EXPECT_TRUE(calibrate_mountings(steps, loops, true).corrected.empty());
  EXPECT_EQ(last_scan(steps).translation(), end.translation());
}

TEST(MountingCalibration, ACameraThatSeesNoWallsTurnsWithItsScanner) {
  std::vector<LoopClosure> loops;
  const MountingCorrection error{{0, 0, 3 * kDegree}, Eigen::Vector3d::Zero()};
  std::vector<Step> steps = drive(error.apply(kMounted), 200, SensorKind::kDepth);
  const auto corrected = calibrate_mountings(steps, loops, true).corrected;
  ASSERT_EQ(corrected.size(), 2);
  EXPECT_EQ(corrected[0].sensor, "scanner");
  EXPECT_EQ(corrected[1].sensor, "camera");
  const SE3 T_scanner = steps[4].observations.T_body_sensor;
  const SE3 T_camera = steps[5].observations.T_body_sensor;
  EXPECT_NEAR(T_scanner.so3().yaw(), 0.4, 0.05 * kDegree);
  EXPECT_NEAR(T_camera.so3().yaw(), -3 * kDegree, 0.05 * kDegree);
}

TEST(MountingCalibration, ScannersOfWhichThereAreTwoStay) {
  std::vector<LoopClosure> loops;
  const MountingCorrection error{{0, 0, 3 * kDegree}, Eigen::Vector3d::Zero()};
  std::vector<Step> steps = drive(error.apply(kMounted), 200);
  steps[100].scan->lidar.T_body_lidar = kMounted;
  EXPECT_TRUE(calibrate_mountings(steps, loops, true).corrected.empty());
}

TEST(MountingCalibration, WhatWheelsAloneToldIsNotTurned) {
  const MountingCorrection error{{0, 0, 3 * kDegree}, Eigen::Vector3d::Zero()};
  std::vector<Step> steps = drive(error.apply(kMounted), 200);
  for (std::size_t i = 100; i < 140; i += 2) {
    steps[i].scan_motion->status = ScanMotion::Status::kPredicted;
    steps[i].motion.T_from_to = SE3::planar(0.05, 0, 0.01);
  }
  std::vector<LoopClosure> loops;
  ASSERT_EQ(calibrate_mountings(steps, loops, true).corrected.size(), 1);
  EXPECT_LT((steps[110].motion.T_from_to.translation() - Eigen::Vector3d(0.05, 0, 0)).norm(), 1e-9);
}

TEST(MountingCalibration, WithoutAFloorTheWheelsTellNoHeading) {
  std::vector<LoopClosure> loops;
  const MountingCorrection error{{0, 0, 3 * kDegree}, Eigen::Vector3d::Zero()};
  std::vector<Step> steps = drive(error.apply(kMounted), 200);
  EXPECT_TRUE(calibrate_mountings(steps, loops, false).corrected.empty());
}

TEST(MountingCalibration, WhatASensorSawMovesWithIt) {
  Step step;
  step.observations.T_body_sensor = SE3(SO3(), {1, 0, 0});
  step.observations.obstacle_points_body = {{2, 0, 0}};
  step.T_body_levelled = SE3(SO3(), {1, 0, 0});
  apply_correction(step, {{0, 0, M_PI / 2}, {0, 0, 0.5}});
  EXPECT_LT((step.observations.T_body_sensor.translation() - Eigen::Vector3d(1, 0, 0.5)).norm(),
            1e-12);
  EXPECT_LT((step.observations.obstacle_points_body[0] - Eigen::Vector3d(1, 1, 0.5)).norm(), 1e-12);
  EXPECT_NEAR(step.T_body_levelled.so3().yaw(), M_PI / 2, 1e-12);
}

}  // namespace
}  // namespace lamina
