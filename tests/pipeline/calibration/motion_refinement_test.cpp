// Motions of wheels, told better by the depth images between them.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/models/skipped.hpp>
#include <lamina/pipeline/calibration/motion_refinement.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

constexpr int kImages = 12;

// Towards the corner of a room, turning a little.
SE3 pose(int i) { return SE3::planar(0.06 * i, 0.01 * i, 0.01 * i); }
constexpr int kChange = 5;  // the first image after it
Timestamp stamp(int i) { return Timestamp::from_seconds(1000 + 0.1 * i); }

// What happens without a word of the wheels.
enum class What { kNothing, kCarried, kDoorOpens };

class DriveRecording final : public Recording {
 public:
  std::optional<Measurement> next() override {
    while (given_ < kImages && given_ == without) ++given_;
    if (given_ == kImages) return std::nullopt;
    if (given_ == breaks_at) throw Error("the file ends here");
    const DepthCamera camera = testing::small_test_camera(0.3);
    const bool changed = given_ >= kChange;
    const SE3 carried = what == What::kCarried && changed ? SE3::planar(-3, 0, 0.3) : SE3();
    const double wall = what == What::kDoorOpens && changed ? 5 : 3;
    const SE3 T_body_world = (carried * pose(given_)).inverse();
    std::vector<testing::Piece> pieces;
    for (const Plane& plane : {Plane({0, 0, 1}, 0), Plane({-1, 0, 0}, -wall),
                               Plane({0, -1, 0}, -1.5), Plane({-0.6, 0.8, 0}, -2.4)}) {
      pieces.push_back({T_body_world * plane});
    }
    DepthFrame frame = testing::draw(pieces, camera, 0.02, static_cast<std::uint64_t>(given_ + 1));
    frame.stamp = stamp(given_++);
    return frame;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }

  explicit DriveRecording(int the_missing = -1, int the_broken = -1, What happens = What::kNothing)
      : without(the_missing), breaks_at(the_broken), what(happens) {}

 private:
  int without, breaks_at;
  What what;
  int given_ = 0;
  Calibration calibration_;
};

OpenRecording opens(int without = -1, int breaks_at = -1) {
  return [=] { return std::make_unique<DriveRecording>(without, breaks_at); };
}

// Wheels that say a tenth too much, and drift.
std::vector<Step> steps_by_wheels() {
  std::vector<Step> steps(kImages);
  for (int i = 0; i < kImages; ++i) {
    Step& step = steps[static_cast<std::size_t>(i)];
    step.observations.stamp = stamp(i);
    step.observations.T_body_sensor = testing::test_camera(0.3).camera.T_body_camera;
    step.motion.covariance = 4e-5 * Matrix6d::Identity();
    if (i == 0) continue;
    const Vector6d moved = (pose(i - 1).inverse() * pose(i)).log();
    step.motion.T_from_to = SE3::exp(1.1 * moved) * SE3::planar(0, 0, 0.004);
  }
  return steps;
}

double error(const std::vector<Step>& steps) {
  SE3 T;
  for (const Step& step : steps) T = T * step.motion.T_from_to;
  return ((pose(0).inverse() * pose(kImages - 1)).inverse() * T).translation().norm();
}

const auto kOn = [] { return false; };

// The steps that lost tracking.
std::vector<int> lost(What happens) {
  const OpenRecording open = [happens] {
    return std::make_unique<DriveRecording>(-1, -1, happens);
  };
  std::vector<Step> steps = steps_by_wheels();
  refine_motions_by_images(open, {}, steps, false, kOn);
  std::vector<int> result;
  for (int i = 0; i < kImages; ++i)
    if (steps[static_cast<std::size_t>(i)].tracking_lost) result.push_back(i);
  return result;
}

// A robot set down elsewhere, of which wheels say nothing, made a map metres off without a word.
TEST(ImageMotion, ARobotCarriedAwayIsSaid) {
  EXPECT_EQ(lost(What::kCarried), std::vector<int>{kChange});
}

TEST(ImageMotion, ADoorThatOpensIsNoOtherPlace) { EXPECT_TRUE(lost(What::kDoorOpens).empty()); }

TEST(ImageMotion, ImagesTellBetterThanWheels) {
  std::vector<Step> steps = steps_by_wheels();
  const double before = error(steps);
  EXPECT_EQ(refine_motions_by_images(opens(), {}, steps, true, kOn).observed, kImages - 1);
  EXPECT_GT(before, 0.06);
  EXPECT_LT(error(steps), 0.3 * before);
  for (std::size_t i = 1; i < steps.size(); ++i) {
    EXPECT_LT(steps[i].motion.covariance(0, 0), 4e-5);
    EXPECT_GT(steps[i].motion.covariance(0, 0), 0);
  }
}

DepthMotion motion_against(double metres, ScanMotion::Status status) {
  DepthMotion motion;
  motion.status = status;
  motion.covariance = 1e-6 * Matrix6d::Identity();
  motion.against_wheels_m = metres;
  return motion;
}

// Wheels stood while the last image moved: what the next one leaves open is not theirs to tell.
TEST(MotionBesideWheels, WhatImagesLeaveOpenAmongContradictionsIsAGuess) {
  MotionBesideWheels beside;
  using Status = ScanMotion::Status;
  const auto variance = [&](double metres, Status status) {
    const auto observed = beside.add(Timestamp(), motion_against(metres, status));
    return observed ? observed->covariance(0, 0) : -1;
  };
  EXPECT_EQ(variance(0, Status::kPredicted), -1);
  EXPECT_EQ(variance(0.2, Status::kTracked), 1e-6);
  EXPECT_NEAR(variance(0, Status::kDegenerate), 0.04, 1e-3);
  EXPECT_NEAR(variance(0, Status::kPredicted), 0.04, 1e-3);
  EXPECT_EQ(variance(0, Status::kTracked), 1e-6);
  EXPECT_EQ(variance(0, Status::kPredicted), -1);
  EXPECT_EQ(beside.against().images, 1);
}

TEST(MotionBesideWheels, WheelsThatStandAreSaidASlipIsNot) {
  Diagnostics slip, dead;
  tell_against_wheels({2, Timestamp(), Timestamp(), 0.1, 0.4}, slip);
  tell_against_wheels({20, Timestamp(), Timestamp(), 4, 1}, dead);
  EXPECT_TRUE(slip.warnings.empty());
  ASSERT_EQ(dead.warnings.size(), 1U);
  EXPECT_EQ(dead.warnings[0].id, "odometry_contradicted");
}

TEST(ImageMotion, WheelsStayWhereAnImageIsMissing) {
  std::vector<Step> steps = steps_by_wheels();
  const std::vector<Step> wheels = steps;
  // The way to the missing image and the way from it.
  EXPECT_EQ(refine_motions_by_images(opens(5), {}, steps, true, kOn).observed, kImages - 3);
  for (const std::size_t i : {5U, 6U}) {
    EXPECT_EQ(steps[i].motion.T_from_to.translation(), wheels[i].motion.T_from_to.translation());
  }
  EXPECT_NE(steps[7].motion.T_from_to.translation(), wheels[7].motion.T_from_to.translation());
}

TEST(ImageMotion, AnImageWithoutAStepIsPassedOver) {
  std::vector<Step> steps = steps_by_wheels();
  steps.erase(steps.begin() + 3);
  const SE3 wheels = steps[3].motion.T_from_to;  // from the step before the one that is gone
  EXPECT_GT(refine_motions_by_images(opens(), {}, steps, true, kOn).observed, 5);
  EXPECT_NE(steps[4].motion.T_from_to.translation(), wheels.translation());
}

TEST(ImageMotion, EndsWithTheUserOrTheFile) {
  std::vector<Step> steps = steps_by_wheels();
  EXPECT_EQ(refine_motions_by_images(opens(), {}, steps, true, [] { return true; }).observed, 0);
  EXPECT_EQ(refine_motions_by_images(opens(-1, 4), {}, steps, true, kOn).observed, 3);
}

TEST(ImageMotion, WhatNothingMeasuredStays) {
  std::vector<Step> steps = steps_by_wheels();
  steps[6].motion_known = false;
  const SE3 guessed = steps[6].motion.T_from_to;
  EXPECT_EQ(refine_motions_by_images(opens(), {}, steps, true, kOn).observed, kImages - 2);
  EXPECT_EQ(steps[6].motion.T_from_to.translation(), guessed.translation());
}

}  // namespace
}  // namespace lamina
