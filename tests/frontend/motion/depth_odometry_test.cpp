// Depth odometry among planes whose answer is known.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <random>

#include <lamina/frontend/motion/block_matching.hpp>
#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/moving_blocks.hpp>

#include "frontend/motion/plane_camera.hpp"

namespace lamina {
namespace {

using namespace made_up;

SE3 pose(int i) {
  return SE3(SO3::rot_z(0.01 * i) * SO3::rot_y(0.05 * std::sin(0.2 * i)),
             {0.02 * i, 0.1 * std::sin(0.1 * i), 0.05 * std::sin(0.15 * i)});
}

TEST(DepthBlocks, NormalsOfAnExactPlane) {
  Camera camera;
  camera.sigma_scale = 0;
  const DepthFrame frame = camera.see({{{0, 0, 1}, 0}}, SE3(SO3::rot_y(0.5), {0, 0, 0}), 0);
  const DepthBlocks blocks = depth_blocks(frame);
  const SE3 T = SE3(SO3::rot_y(0.5), {0, 0, 0}) * frame.camera.camera.T_body_camera;
  int oriented = 0;
  for (const DepthBlock& b : blocks.blocks) {
    if (!b.oriented()) continue;
    ++oriented;
    EXPECT_GT((T.so3() * b.normal.cast<double>()).z(), 0.9999);
    EXPECT_NEAR((T * b.point.cast<double>()).z(), 0, 0.003);
    EXPECT_GT(b.sigma, 0);
  }
  EXPECT_GT(oriented, 5000);
}

TEST(DepthOdometry, FollowsARoom) {
  Camera camera;
  DepthOdometry odometry;
  SE3 T;
  int keys = 0;
  for (int i = 0; i < 24; ++i) {
    const DepthMotion m = odometry.process(camera.see(room(), pose(i), i / 30.0));
    T = T * m.T_prev_curr_body;
    keys += m.key_frame;
    EXPECT_NE(m.status, ScanMotion::Status::kPredicted);
    EXPECT_LE(m.unknown_directions, 1);
  }
  const SE3 e = (pose(0).inverse() * pose(23)).inverse() * T;
  EXPECT_LT(e.translation().norm(), 0.035);
  EXPECT_LT(e.so3().log().norm(), 0.008);
  EXPECT_GT(keys, 1);
}

// Five images a second, nine degrees from one to the next, then straight on: what constant velocity
// expects is a turn away from what comes.
TEST(DepthOdometry, ATurnThatEndsBetweenTwoSlowImagesIsFollowed) {
  Camera camera;
  DepthOdometry odometry;
  SE3 T_world_body(SO3::rot_z(-0.4), {-1.0, 0, 0}), T_start_body;
  const SE3 start = T_world_body;
  for (int i = 0; i < 12; ++i) {
    if (i > 0)
      T_world_body = T_world_body * (i < 5 ? SE3::planar(0, 0, 0.16) : SE3::planar(0.1, 0, 0));
    const DepthMotion m = odometry.process(camera.see(room(), T_world_body, 0.2 * i));
    T_start_body = T_start_body * m.T_prev_curr_body;
    EXPECT_NE(m.status, ScanMotion::Status::kPredicted);
  }
  const SE3 e = (start.inverse() * T_world_body).inverse() * T_start_body;
  EXPECT_LT(e.translation().norm(), 0.08);
  EXPECT_LT(e.so3().log().norm(), 0.02);
}

TEST(DepthOdometry, CorridorLeavesOneDirectionToTheGuess) {
  Camera camera;
  DepthOdometry odometry;
  SE3 T;
  for (int i = 0; i < 15; ++i) {
    std::optional<MotionGuess> guess;
    if (i > 0) {
      guess = MotionGuess{SE3::planar(0.05, 0, 0), Matrix6d::Identity() * 4e-4};
    }
    const SE3 truth(SO3::rot_y(0.3),
                    {0.05 * std::cos(0.3) * i, 0.01 * i, -0.05 * std::sin(0.3) * i});
    const DepthMotion m = odometry.process(camera.see(corridor(), truth, i / 30.0), guess);
    T = T * m.T_prev_curr_body;
    if (i == 0) continue;
    EXPECT_EQ(m.status, ScanMotion::Status::kDegenerate);
    EXPECT_EQ(m.unknown_directions, 1);
    EXPECT_GT(m.covariance(0, 0), 2e-4);
    EXPECT_LT(m.covariance(1, 1), 1e-4);
  }
  EXPECT_NEAR(T.translation().x(), 0.7, 0.05);
  EXPECT_NEAR(T.translation().y(), 0.14, 0.02);
}

// Bare walls along the way, its end eight metres ahead, and an image that bends by half a pixel:
// the bent walls, alike in every image, must not say that the camera stands still.
TEST(DepthOdometry, TheEndOfACorridorTellsTheWay) {
  Camera camera;
  camera.bend = 0.5;
  Planes closed = corridor();
  closed.push_back({{-1, 0, 0}, -8});
  DepthOdometry odometry;
  SE3 T;
  for (int i = 0; i < 24; ++i) {
    const SE3 truth(SO3::rot_y(0.1), {0.06 * i, 0, 0});
    const DepthMotion m = odometry.process(camera.see(closed, truth, i / 30.0));
    T = T * m.T_prev_curr_body;
    EXPECT_NE(m.status, ScanMotion::Status::kPredicted);
  }
  // From standing still; the way along the body's x, which looks down a little.
  EXPECT_NEAR(T.translation().x(), 0.06 * 23 * std::cos(0.1), 0.15);
  EXPECT_NEAR(T.translation().y(), 0, 0.05);
}

// The noise of normals of walls along the view does not point along it.
TEST(DepthBlocks, WallsAlongTheViewHardlyTurnAcrossIt) {
  Camera camera;
  const DepthFrame frame = camera.see({{{0, 1, 0}, -1}}, SE3(), 0);
  int seen = 0;
  for (const DepthBlock& b : depth_blocks(frame).blocks) {
    if (!b.oriented() || b.point.z() < 3) continue;
    ++seen;
    // The wall is x = const of the camera; its normal turns about the vertical, towards z.
    const auto [by_a, by_b] = tilt_axes(b);
    EXPECT_LT(std::abs(by_a.z()), 0.5F);
    EXPECT_LT(std::abs(by_b.z()), 0.45F);  // the place of the block: 60 of 140 px
    EXPECT_LT(b.tilt, 0.05F);
    EXPECT_NEAR(by_a.dot(b.normal), 0, 1e-4);
    EXPECT_NEAR(by_b.dot(b.normal), 0, 1e-4);
  }
  EXPECT_GT(seen, 100);
}

TEST(HardDirections, AreThoseThatFewBlocksHold) {
  Matrix6d H = Matrix6d::Zero();
  H.diagonal() << 1000, 10, 1000, 4000, 4000, 4000;  // at a lever of 2 m all turns are 1000
  const auto hard = hard_directions(H, 2, 0.05);
  ASSERT_EQ(hard.size(), 1U);
  EXPECT_NEAR(std::abs(hard[0].tangent(1)), 1, 1e-9);
  EXPECT_NEAR(hard[0].tangent.dot(hard[0].covector), 1, 1e-9);
  EXPECT_TRUE(hard_directions(Matrix6d::Identity(), 1, 0.05).empty());
  // Taken out where what is left of it is below the limit.
  Vector6d b = Vector6d::Ones();
  Matrix6d doubtful = Matrix6d::Zero();
  doubtful(2, 2) = 995;
  const auto missing = without_weak_directions(H, b, doubtful, 2, 8);
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_NEAR(std::abs(missing[0](2)), 1, 1e-9);
  EXPECT_NEAR(H(2, 2), 0, 1e-9);
  EXPECT_NEAR(H(1, 1), 10, 1e-9);
  EXPECT_NEAR(b(2), 0, 1e-9);
  EXPECT_NEAR(b(3), 1, 1e-9);
}

TEST(DepthOdometry, OnePlaneLeavesThree) {
  Camera camera;
  DepthOdometry odometry;
  const Planes wall{{{-1, 0, 0}, -2}};
  odometry.process(camera.see(wall, SE3(), 0));
  const DepthMotion m = odometry.process(camera.see(wall, SE3::planar(0.02, 0, 0), 1 / 30.0));
  EXPECT_EQ(m.unknown_directions, 3);
  EXPECT_NEAR(m.T_prev_curr_body.translation().x(), 0.02, 0.004);
}

TEST(DepthOdometry, EmptyFramesArePredictedAndNeverNaN) {
  Camera camera;
  DepthOdometry odometry;
  for (int i = 0; i < 12; ++i) {
    DepthFrame frame = camera.see(room(), pose(i), i / 30.0);
    if (i % 4 == 2) frame.raw.assign(frame.raw.size(), 0);
    if (i % 4 == 3) frame.raw.clear();
    const DepthMotion m = odometry.process(frame);
    EXPECT_TRUE(m.covariance.allFinite());
    EXPECT_TRUE(m.T_prev_curr_body.matrix().allFinite());
    if (i % 4 >= 2) {
      EXPECT_EQ(m.status, ScanMotion::Status::kPredicted);
      EXPECT_GT(m.covariance(0, 0), 1e-4);
    }
  }
}

TEST(DepthOdometry, CovarianceIsNeitherBoastfulNorUseless) {
  double sum = 0;
  for (int k = 0; k < 8; ++k) {
    Camera camera;
    camera.rng.seed(static_cast<unsigned>(k));
    camera.sigma_scale = 1;  // exactly what the noise model says
    DepthOdometry odometry;
    odometry.process(camera.see(room(), pose(k), 0));
    const DepthMotion m = odometry.process(camera.see(room(), pose(k + 1), 1 / 30.0));
    const Vector6d e = ((pose(k).inverse() * pose(k + 1)).inverse() * m.T_prev_curr_body).log();
    sum += e.dot(m.covariance.inverse() * e);
  }
  EXPECT_LT(sum / 8, 9.0);  // six directions; white noise: samples_per_fact makes it smaller
  EXPECT_GT(sum / 8, 0.1);
}

/// Something as wide as a person, 1.2 m away, from column `left` on.
void put_person(DepthFrame& frame, int left, int wide = 30) {
  for (int v = 0; v < frame.camera.camera.height; ++v) {
    for (int u = std::max(left, 0); u < std::min(left + wide, frame.camera.camera.width); ++u) {
      const int off = u - left - wide / 2;  // round in front
      frame.raw[static_cast<std::size_t>(v * frame.camera.camera.width + u)] =
          static_cast<std::uint16_t>((1.2 + 0.0005 * off * off) * frame.camera.depth_scale);
    }
  }
}

TEST(MovingBlocks, WhatStandsStillIsNeverMarked) {
  Camera camera;
  const DepthBlocks a = depth_blocks(camera.see(room(), pose(0), 0));
  const DepthFrame frame = camera.see(room(), pose(8), 1);
  const DepthBlocks b = depth_blocks(frame);
  const SE3& mounting = frame.camera.camera.T_body_camera;
  const SE3 T_a_b = mounting.inverse() * pose(0).inverse() * pose(8) * mounting;
  EXPECT_TRUE(moving_blocks(a, b, T_a_b).empty());
  EXPECT_TRUE(moving_blocks(b, a, T_a_b.inverse()).empty());
}

TEST(MovingBlocks, WhatCameIsMarkedAndHardlyMore) {
  Camera camera;
  const DepthBlocks before = depth_blocks(camera.see(room(), pose(0), 0));
  DepthFrame frame = camera.see(room(), pose(0), 1);
  put_person(frame, 60);
  DepthBlocks after = depth_blocks(frame);
  const auto marks = moving_blocks(before, after, SE3());
  ASSERT_EQ(marks.size(), after.blocks.size());
  int person = 0, missed = 0, beside = 0;
  for (int v = 0, i = 0; v < after.height; ++v) {
    for (int u = 0; u < after.width; ++u, ++i) {
      const DepthBlock& block = after.at(u, v);
      const bool of_person = block.valid() && block.point.z() < 1.35F;
      person += of_person;
      missed += of_person && !marks[static_cast<std::size_t>(i)];
      beside += block.valid() && !of_person && marks[static_cast<std::size_t>(i)];
    }
  }
  EXPECT_GT(person, 1000);
  EXPECT_LT(missed, person / 20);
  EXPECT_LT(beside, person / 4);  // two blocks to either side
  // The image without it shows nothing where there was free space.
  EXPECT_TRUE(moving_blocks(after, before, SE3()).empty());
  EXPECT_GT(drop_blocks(after, marks), 0.1);
  EXPECT_TRUE(moving_blocks(before, after, SE3()).empty());
}

TEST(GainedAgreement, IsOfTheRightPoseOverOneThatIsOff) {
  Camera camera;
  const DepthBlocks key = depth_blocks(camera.see(room(), pose(0), 0));
  const DepthBlocks now = depth_blocks(camera.see(room(), pose(0), 1));
  const BlockGate gate{0, 4, 0, 0.8F, 2.5e-5F};
  const SE3 off(SO3::rot_y(0.02), {0.03, 0, 0.02});
  EXPECT_EQ(gained_agreement(key, now, off, off, 2, gate), 0);
  EXPECT_GT(gained_agreement(key, now, off, SE3(), 2, gate), 0.2);
  EXPECT_NEAR(gained_agreement(key, now, off, SE3(), 2, gate),
              -gained_agreement(key, now, SE3(), off, 2, gate), 1e-6);
  // Blocks that leave the view count for neither: a wall alone fits as well wherever it is slid.
  const Planes wall{{{-1, 0, 0}, -2}};
  const DepthBlocks plain = depth_blocks(camera.see(wall, SE3(), 0));
  const SE3 aside(SO3(), {0.5, 0, 0});  // along the wall, camera frame
  EXPECT_NEAR(gained_agreement(plain, plain, SE3(), aside, 2, gate), 0, 0.05);
}

TEST(GainedAgreement, CornersOfImagesSayNothing) {
  Camera camera;
  const DepthBlocks key = depth_blocks(camera.see(room(), pose(0), 0));
  const SE3 turned(SO3::rot_y(0.9), Eigen::Vector3d::Zero());  // of the field of view's 1.04 rad
  const SE3 there(SO3::rot_y(0.45), Eigen::Vector3d::Zero());
  const BlockGate gate{0, 4, 0, 0.8F, 2.5e-5F};
  const DepthBlocks now =
      depth_blocks(camera.see(room(), SE3(SO3::rot_z(-0.45), Eigen::Vector3d::Zero()), 1));
  EXPECT_GT(gained_agreement(key, now, SE3(), there, 2, gate), 0.2);
  EXPECT_EQ(gained_agreement(key, now, turned, there, 2, gate), 0);
  EXPECT_EQ(gained_agreement(key, now, there, turned, 2, gate), 0);
}

TEST(MovingBlocks, FewPlacesAreNoise) {
  Camera camera;
  const DepthBlocks before = depth_blocks(camera.see(room(), pose(0), 0));
  DepthBlocks after = before;
  DepthBlock& speck = after.blocks[after.blocks.size() / 2];
  speck.point *= 0.5F;
  EXPECT_TRUE(moving_blocks(before, after, SE3()).empty());
}

// The path is the one of the room without them.
TEST(DepthOdometry, APersonSaysNothingOfTheMotion) {
  Camera camera;
  DepthOdometry alone, with_person;
  SE3 T_alone, T_with;
  double most = 0;
  for (int i = 0; i < 12; ++i) {
    DepthFrame frame = camera.see(room(), pose(i), i / 30.0);
    T_alone = T_alone * alone.process(frame).T_prev_curr_body;
    if (i > 2) put_person(frame, 10 * i);
    const DepthMotion motion = with_person.process(frame);
    T_with = T_with * motion.T_prev_curr_body;
    most = std::max(most, motion.moving);
  }
  EXPECT_GT(most, 0.05);
  EXPECT_LT((T_with.inverse() * T_alone).translation().norm(), 0.003);
  EXPECT_LT((T_with.inverse() * T_alone).so3().log().norm(), 0.002);
}

TEST(DepthOdometry, SaysHowMuchHeadingItGuessed) {
  Camera camera;
  DepthOdometry in_room, over_floor;
  const Planes floor = {{{0, 0, 1}, 0}};
  DepthMotion seen, guessed;
  for (int i = 0; i < 40; ++i) {
    seen = in_room.process(camera.see(room(), pose(i / 4), i / 30.0));
    guessed = over_floor.process(camera.see(i < 4 ? room() : floor, pose(i / 4), i / 30.0));
  }
  EXPECT_EQ(seen.heading_guessed, 0);
  EXPECT_GT(guessed.heading_guessed, 0.05);
}

}  // namespace
}  // namespace lamina
