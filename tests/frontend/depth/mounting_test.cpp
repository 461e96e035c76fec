// The choice of the floor and the tracked mounting.
#include <gtest/gtest.h>

#include <lamina/frontend/depth/dominant_floor.hpp>
#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/frontend/depth/mounting_tracker.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
const SE3 kMounting = testing::test_camera().camera.T_body_camera;

Plane floor_of(const SE3& T_body_camera) { return T_body_camera.inverse() * Plane(); }

SE3 turned(double roll_deg, double pitch_deg, double height = 0) {
  return apply({roll_deg * kDegree, pitch_deg * kDegree, kMounting.translation().z() + height},
               kMounting);
}

TEST(Leveling, IsUndoneByItsInverse) {
  for (const double roll : {-5.0, 0.0, 3.0}) {
    for (const double pitch : {-20.0, 0.0, 5.0}) {
      const SE3 truth = turned(roll, pitch, 0.05);
      const SE3 found = leveled(kMounting, floor_of(truth));
      EXPECT_LT((found.inverse() * truth).log().norm(), 1e-9) << roll << ' ' << pitch;
    }
  }
}

TEST(Leveling, OfAFloorSeenFromBelowIsDefined) {
  const Leveling l = leveling_of(SE3(), Plane({0, 0, -1}, -2));
  EXPECT_NEAR(l.roll, M_PI, 1e-12);
  EXPECT_NEAR(l.height, 2, 1e-12);
}

FloorChoice choose(const std::vector<FloorCandidate>& c, MountingKnowledge knowledge) {
  return choose_floor(c, 640 * 480, {kMounting, knowledge}, FloorOptions());
}

TEST(DominantFloor, ATurnedMountingKeepsTheCamerasHeight) {
  const FloorCandidate floor{floor_of(turned(3, -4)), 1e5, 4};
  EXPECT_EQ(choose({floor}, MountingKnowledge::kCalibrated).status, FloorStatus::kFound);
}

TEST(DominantFloor, ARampAloneIsRefused) {
  // Rises 8 deg from 1.2 m ahead: tilted, and not 0.8 m from the camera.
  const Plane ramp_body(Eigen::Vector3d(-std::sin(8 * kDegree), 0, std::cos(8 * kDegree)),
                        -1.2 * std::sin(8 * kDegree));
  const FloorCandidate ramp{kMounting.inverse() * ramp_body, 1e5, 4};
  EXPECT_EQ(choose({ramp}, MountingKnowledge::kCalibrated).status, FloorStatus::kAmbiguous);
}

// Half a metre before its foot a ramp fills the view; the floor before it lies where it always did.
TEST(DominantFloor, TheFloorBeforeARampThatFillsTheView) {
  const Plane ramp_body(Eigen::Vector3d(-std::sin(5 * kDegree), 0, std::cos(5 * kDegree)),
                        -0.6 * std::sin(5 * kDegree));
  const FloorCandidate ramp{kMounting.inverse() * ramp_body, 1e5, 4};
  const FloorCandidate floor{floor_of(kMounting), 6e4, 0.4};
  const FloorChoice known = choose({ramp, floor}, MountingKnowledge::kTracked);
  EXPECT_EQ(known.status, FloorStatus::kFound);
  EXPECT_EQ(known.index, 1);
  // A tape measure's word does not make a small plane the floor.
  EXPECT_EQ(choose({ramp, floor}, MountingKnowledge::kCalibrated).status, FloorStatus::kAmbiguous);
  EXPECT_EQ(choose({ramp}, MountingKnowledge::kTracked).status, FloorStatus::kAmbiguous);
}

TEST(DominantFloor, StairsAloneAreRefused) {
  std::vector<FloorCandidate> treads;
  for (const double z : {0.34, 0.51, 0.68}) {
    treads.push_back({kMounting.inverse() * Plane({0, 0, 1}, z), 2e4, 0.4});
  }
  EXPECT_EQ(choose(treads, MountingKnowledge::kCalibrated).status, FloorStatus::kAmbiguous);
  // With nothing known, three like levels leave the question open as well.
  std::vector<FloorCandidate> below;
  for (const double z : {-0.3, -0.47, -0.64}) {
    below.push_back({kMounting.inverse() * Plane({0, 0, 1}, z), 2e4, 0.4});
  }
  EXPECT_EQ(choose(below, MountingKnowledge::kUnknown).status, FloorStatus::kAmbiguous);
}

TEST(DominantFloor, AWallIsNoFloorAndASliverIsTooLittle) {
  const FloorCandidate wall{kMounting.inverse() * Plane({-1, 0, 0}, -2), 2e5, 6};
  EXPECT_EQ(choose({wall}, MountingKnowledge::kUnknown).status, FloorStatus::kNoFloor);
  EXPECT_EQ(choose({wall}, MountingKnowledge::kTracked).status, FloorStatus::kNoFloor);
  const FloorCandidate sliver{floor_of(kMounting), 3000, 0.1};
  EXPECT_EQ(choose({sliver}, MountingKnowledge::kCalibrated).status, FloorStatus::kTooSmall);
  EXPECT_EQ(choose({}, MountingKnowledge::kCalibrated).status, FloorStatus::kNoPlanes);
}

// A camera that looks 55 deg down sees its floor much as a wall: taken where it is alone in view.
TEST(DominantFloor, AFloorSeenSteeplyIsTakenWhereItIsAlone) {
  const Plane steep = floor_of(turned(0, 55));
  const Plane wall = kMounting.inverse() * Plane({-1, 0, 0}, -2);
  const FloorCandidate alone{steep, 2.5e5, 1};
  EXPECT_EQ(choose({alone}, MountingKnowledge::kUnknown).status, FloorStatus::kFound);
  EXPECT_EQ(choose({alone, {wall, 1e5, 2}}, MountingKnowledge::kUnknown).status,
            FloorStatus::kNoFloor);
  EXPECT_EQ(choose({{steep, 1e5, 1}}, MountingKnowledge::kUnknown).status, FloorStatus::kNoFloor);
  EXPECT_EQ(choose({{floor_of(turned(0, 75)), 2.5e5, 1}}, MountingKnowledge::kUnknown).status,
            FloorStatus::kNoFloor);
}

TEST(DominantFloor, OfATableAndAFloorTheFloorIsTheLower) {
  const FloorCandidate floor{floor_of(kMounting), 6e4, 2.0};
  const FloorCandidate table{kMounting.inverse() * Plane({0, 0, 1}, 0.5), 9e4, 1.2};
  const FloorChoice c = choose({table, floor}, MountingKnowledge::kCalibrated);
  EXPECT_EQ(c.index, 1);
}

Eigen::Matrix3d frame_noise() {
  const double tilt = 0.05 * kDegree;
  return Eigen::Vector3d(tilt * tilt, tilt * tilt, 1e-6).asDiagonal();
}

TEST(MountingTracker, ConvergesAndReportsAKnock) {
  MountingTracker tracker{FloorOptions()};
  bool reported = false;
  for (int i = 0; i < 40; ++i) {
    const double wobble = 0.05 * std::sin(2.4 * i);
    tracker.update(kMounting, floor_of(turned(wobble, 1 - wobble)), frame_noise());
    if (i > 0) reported |= tracker.estimate().changed;
  }
  EXPECT_FALSE(reported);
  EXPECT_NEAR(tracker.estimate().pitch / kDegree, 1, 0.02);
  EXPECT_TRUE(tracker.estimate().rigid);
  int frames = 0;
  for (; frames < 20 && !reported; ++frames) {
    tracker.update(kMounting, floor_of(turned(0, 1.6)), frame_noise());
    reported = tracker.estimate().changed;
  }
  EXPECT_TRUE(reported);
  EXPECT_LE(frames, FloorOptions().confirm_frames);
  EXPECT_NEAR(tracker.estimate().pitch / kDegree, 1.6, 0.05);
}

// Two centimetres high and two metres long, driven over at 0.5 m/s and ten images a second.
MountingEstimate over_swells(double pitch_deg, double height, const FloorOptions& options) {
  MountingTracker tracker{options};
  for (int i = 0; i < 300; ++i) {
    const double roll = 0.4 * std::cos(0.2 * i + 1), pitch = 0.6 * std::sin(0.25 * i);
    const double rise = 0.008 * std::sin(0.31 * i + 2);
    tracker.update(kMounting, floor_of(turned(roll, pitch_deg + pitch, height + rise)),
                   frame_noise());
  }
  return tracker.estimate();
}

TEST(MountingTracker, SwellsOfTheGroundAreNoMounting) {
  for (const double factor : {0.5, 1.0, 1.5}) {
    FloorOptions options;
    options.mounting_gate *= factor;
    const MountingEstimate e = over_swells(0, 0, options);
    EXPECT_EQ(e.pitch, 0);
    EXPECT_EQ(e.roll, 0);
    EXPECT_EQ(e.height, kMounting.translation().z());
  }
}

TEST(MountingTracker, SwellsOfTheGroundHideNoWrongMounting) {
  for (const double factor : {0.5, 1.0, 1.5}) {
    FloorOptions options;
    options.mounting_gate *= factor;
    const MountingEstimate e = over_swells(2, 0.03, options);
    EXPECT_NEAR(e.pitch / kDegree, 2, 0.3);
    EXPECT_NEAR(e.height, kMounting.translation().z() + 0.03, 0.006);
    EXPECT_LT(std::sqrt(e.covariance(0, 0)) / kDegree, 0.5);
  }
}

// Slopes that face the camera fill more of the image: level ground seems to rise ahead.
TEST(MountingTracker, SlopesThatFaceTheCameraAreNoMounting) {
  for (const double factor : {0.5, 1.0, 1.5}) {
    FloorOptions options;
    options.facing_share *= factor;
    const MountingEstimate e = over_swells(0.08, 0.0015, options);
    EXPECT_EQ(e.pitch, 0) << factor;
    EXPECT_EQ(e.height, kMounting.translation().z()) << factor;
  }
}

// A robot that begins on a slope: one place says nothing where the ground is known to be uneven.
TEST(MountingTracker, OnUnevenGroundTheFirstPlaceIsNoMounting) {
  const auto kept = [](bool known, double factor) {
    FloorOptions options;
    options.ground_frames *= factor;
    MountingTracker tracker{options};
    if (known) tracker.expect_ground({1 * kDegree, 1 * kDegree, 0.01});
    bool stays = true;
    for (int i = 0; i < 100; ++i) {
      tracker.update(kMounting, floor_of(turned(1.2 * std::cos(0.1 * i), 0)), frame_noise());
      stays &= tracker.estimate().roll == 0;
    }
    return stays;
  };
  EXPECT_FALSE(kept(false, 1));
  for (const double factor : {0.5, 1.0, 1.5}) EXPECT_TRUE(kept(true, factor)) << factor;
}

// Driven to at 0.5 m/s and ten images a second, and stood before: both fill the image.
TEST(MountingTracker, ARampAheadIsNoKnock) {
  MountingTracker tracker{FloorOptions()};
  for (int i = 0; i < 30; ++i) tracker.update(kMounting, floor_of(turned(0, 0)), frame_noise());
  const double slope = 5 * kDegree;
  const auto ramp = [slope](double ahead) {
    const Eigen::Vector3d n(-std::sin(slope), 0, std::cos(slope));
    return kMounting.inverse() * Plane(n, n.x() * ahead);
  };
  bool reported = false;
  const auto look = [&](double ahead) {
    tracker.update(kMounting, ramp(ahead), frame_noise());
    reported |= tracker.estimate().changed;
  };
  for (int i = 0; i < 50; ++i) look(0.8);
  for (int i = 0; i < 16; ++i) look(0.8 - 0.05 * i);
  EXPECT_FALSE(reported);
  EXPECT_NEAR(tracker.estimate().pitch, 0, 1e-4);
}

// A robot that stops with its body tilted on the foot of a ramp sees just what a knock looks like.
TEST(MountingTracker, WhereTheGroundSlopesNothingIsAKnock) {
  MountingTracker tracker{FloorOptions()};
  for (int i = 0; i < 30; ++i) tracker.update(kMounting, floor_of(turned(0, 0)), frame_noise());
  tracker.accept_knocks(false);
  for (int i = 0; i < 100; ++i) tracker.update(kMounting, floor_of(turned(0, 5)), frame_noise());
  EXPECT_NEAR(tracker.estimate().pitch, 0, 1e-4);
  tracker.accept_knocks(true);
  tracker.update(kMounting, floor_of(turned(0, 5)), frame_noise());
  EXPECT_NEAR(tracker.estimate().pitch / kDegree, 5, 0.05);
}

TEST(MountingTracker, OneWrongFrameMovesNothing) {
  MountingTracker tracker{FloorOptions()};
  for (int i = 0; i < 10; ++i) tracker.update(kMounting, floor_of(turned(0, 0)), frame_noise());
  tracker.update(kMounting, floor_of(turned(2, 2)), frame_noise());
  EXPECT_NEAR(tracker.estimate().pitch, 0, 1e-6);
  EXPECT_FALSE(tracker.estimate().changed);
}

TEST(MountingTracker, AHandIsNotRigid) {
  for (const double factor : {0.5, 1.0, 1.5}) {
    FloorOptions options;
    options.max_unevenness_deg *= factor;
    MountingTracker tracker{options};
    for (int i = 0; i < 40; ++i) {
      tracker.update(kMounting, floor_of(turned(3 * std::sin(0.9 * i), 4 * std::cos(1.3 * i))),
                     frame_noise());
    }
    EXPECT_FALSE(tracker.estimate().rigid);
    EXPECT_TRUE(over_swells(0, 0, options).rigid);
  }
}

}  // namespace
}  // namespace lamina
