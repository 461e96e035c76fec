// Wheels with known errors beside motions that are right.
#include <gtest/gtest.h>

#include <random>

#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/frontend/motion/wheel_bias_filter.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// A drive of bends, 0.1 m a step, as scans and wheels have it.
struct Drive {
  std::mt19937 rng;
  std::normal_distribution<double> normal{0, 1};
  OdometryModel model;
  WheelLearning learning;
  double seconds = 1000;

  explicit Drive(unsigned seed) : rng(seed) {
    model.sigma_rotation = 0.005;
    model.sigma_rotation_turn = 0.01;
  }

  Timestamp next_stamp() { return Timestamp::from_seconds(seconds += 0.2); }
  Increment wheels(const SE3& truth, const WheelErrors::Vector& errors) {
    // What the errors are taken out of again: to first order they are subtracted.
    const SE3 measured = corrected(truth, -errors);
    const Matrix6d C = increment_covariance(model, truth);
    return {SE3::planar(measured.translation().x() + std::sqrt(C(0, 0)) * normal(rng),
                        measured.translation().y() + std::sqrt(C(1, 1)) * normal(rng),
                        measured.so3().yaw() + std::sqrt(C(5, 5)) * normal(rng)),
            C};
  }
  void go(int steps, const WheelErrors::Vector& errors) {
    for (int i = 0; i < steps; ++i) {
      const SE3 truth = SE3::planar(0.1, 0, 0.08 * std::sin(0.05 * i));
      const SE3 scans =
          truth * SE3::planar(0.001 * normal(rng), 0.001 * normal(rng), 0.0005 * normal(rng));
      learning.add(next_stamp(), wheels(truth, errors), scans);
    }
  }
};

TEST(WheelLearning, LearnsScaleDriftAndTurns) {
  const WheelErrors::Vector errors = WheelErrors::of(0.08, 0.6 * kDegree, -0.04);
  Drive drive(1);
  drive.go(600, errors);
  const Eigen::Vector3d off = drive.learning.errors() - errors.head<3>();
  EXPECT_LT(off.dot(drive.learning.covariance().inverse() * off), 16);
  EXPECT_LT(std::abs(off(0)), 0.015);
  EXPECT_LT(std::abs(off(1)), 0.1 * kDegree);
  // Corrected motions are the true ones, wheels' noise aside.
  SE3 corrected_path, true_path;
  const Increment one{corrected(SE3::planar(0.1, 0, 0.02), -errors), Matrix6d::Identity()};
  for (int i = 0; i < 100; ++i) {
    corrected_path = corrected_path * drive.learning.corrected(one).T_from_to;
    true_path = true_path * SE3::planar(0.1, 0, 0.02);
  }
  EXPECT_LT((corrected_path.translation() - true_path.translation()).norm(), 0.2);
}

// What a look over the recording told is taken out from the first step on, and still where the slow
// walk has made it less sure than what is taken out by itself.
TEST(WheelLearning, BeginsWithWhatIsKnown) {
  Drive drive(7);
  const Increment one{SE3::planar(0.1, 0, 0.02), Matrix6d::Identity()};
  EXPECT_EQ(drive.learning.corrected(one).T_from_to.translation(), one.T_from_to.translation());
  drive.learning.begin(-0.009, 0.001);
  EXPECT_NEAR(drive.learning.corrected(one).T_from_to.translation().x(), 0.0991, 1e-5);
  EXPECT_DOUBLE_EQ(drive.learning.corrected(one).T_from_to.so3().yaw(), 0.02);
  drive.go(2000, WheelErrors::of(-0.009, 0, 0));
  EXPECT_GT(3 * std::sqrt(drive.learning.covariance()(0, 0)), 0.009);
  EXPECT_LT(drive.learning.corrected(one).T_from_to.translation().x(), 0.0997);
}

// Their own noise on a straight way is no sign that turns are counted short.
TEST(WheelLearning, AStraightWayTellsNothingOfTurns) {
  Drive drive(3);
  drive.model.sigma_rotation = 0.02;
  for (int i = 0; i < 3000; ++i) {
    const SE3 truth = SE3::planar(0.1, 0, 0);
    const SE3 scans = SE3::planar(0.1, 0, 0.0005 * drive.normal(drive.rng));
    drive.learning.add(drive.next_stamp(),
                       drive.wheels(truth, WheelErrors::of(0, 0.1 * kDegree, 0)), scans);
  }
  EXPECT_LT(std::abs(drive.learning.errors()(2)), 0.02);
}

// Once it fits what comes after: a scale by itself, and so what makes turns.
TEST(WheelLearning, ScaleAndTurnsAreTakenOutEachByItself) {
  const Increment one{SE3::planar(0.1, 0, 0.02), Matrix6d::Identity()};
  for (const bool scale : {true, false}) {
    Drive drive(11);
    drive.go(150, scale ? WheelErrors::of(0.03, 0, 0) : WheelErrors::of(0, 1 * kDegree, 0));
    EXPECT_EQ(drive.learning.corrected(one).T_from_to.translation(), one.T_from_to.translation());
    drive.go(3000, scale ? WheelErrors::of(0.03, 0, 0) : WheelErrors::of(0, 1 * kDegree, 0));
    const SE3 T = drive.learning.corrected(one).T_from_to;
    EXPECT_EQ(drive.learning.scale_adoption().adopted, scale);
    EXPECT_EQ(drive.learning.turn_adoption().adopted, !scale);
    EXPECT_EQ(T.so3().yaw() != one.T_from_to.so3().yaw(), !scale);
    EXPECT_EQ(std::abs(T.translation().norm() - 0.1) > 1e-4, scale);
  }
}

TEST(WheelLearning, SwitchedOffItTakesNothingOut) {
  Drive drive(12);
  drive.learning = WheelLearning(false);
  drive.go(3000, WheelErrors::of(0.08, 1 * kDegree, 0));
  EXPECT_TRUE(drive.learning.errors().isZero(0));
}

TEST(WheelLearning, RightWheelsStayAsTheyAre) {
  int changed = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    Drive drive(100 + seed);
    drive.go(400, WheelErrors::Vector::Zero());
    const Increment one{SE3::planar(0.1, 0.01, 0.02), Matrix6d::Identity()};
    const Increment same = drive.learning.corrected(one);
    changed += same.T_from_to.translation() != one.T_from_to.translation() ||
               same.covariance != one.covariance;
  }
  EXPECT_LE(changed, 1);
}

TEST(WheelLearning, WhatIsNotLawfulTellsNothing) {
  Drive drive(5);
  for (int i = 0; i < 200; ++i) {
    // Counters without a sign on the way back, and wheels that spin.
    const bool back = i % 50 > 25;
    const SE3 scans = SE3::planar(back ? -0.1 : 0.1, 0, 0);
    const SE3 observed = SE3::planar(i % 50 < 5 ? 0.5 : 0.1, 0, 0);
    drive.learning.add(drive.next_stamp(),
                       Increment{observed, increment_covariance(drive.model, observed)}, scans);
  }
  EXPECT_LT(std::abs(drive.learning.errors()(0)), 0.03);
  // Without one of the two there is nothing to compare.
  const Eigen::Vector3d before = drive.learning.errors();
  for (int i = 0; i < 100; ++i) {
    drive.learning.add(drive.next_stamp(), std::nullopt, SE3::planar(0.1, 0, 0));
    drive.learning.add(drive.next_stamp(),
                       drive.wheels(SE3::planar(0.1, 0, 0), WheelErrors::of(0.1, 0, 0)),
                       std::nullopt);
  }
  EXPECT_EQ(drive.learning.errors(), before);
}

}  // namespace
}  // namespace lamina
