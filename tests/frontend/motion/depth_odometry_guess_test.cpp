// Where surfaces leave the motion open, or wheels and images disagree about it.
#include <gtest/gtest.h>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/sensors/odometry.hpp>

#include "frontend/motion/plane_camera.hpp"

namespace lamina {
namespace {

using namespace made_up;

// A hall: its floor, and a wall ahead of which a camera that looks down sees a little. A wheel
// spins for two images; wheels that are sure of themselves say that the body turned by 5 degrees in
// each.
TEST(DepthOdometry, AWheelThatSlipsIsNotBelievedAgainstAWall) {
  const Planes hall = {{Eigen::Vector3d::UnitZ(), 0}, {-Eigen::Vector3d::UnitX(), -5.5}};
  Camera camera;
  DepthOdometry odometry;
  SE3 T_world_body(SO3::rot_y(0.1), Eigen::Vector3d::Zero()), T_start_body;
  const SE3 start = T_world_body;
  for (int i = 0; i < 12; ++i) {
    if (i > 0) T_world_body = T_world_body * SE3::planar(0.05, 0, 0);
    const bool slips = i == 6 || i == 7;
    const SE3 wheels = SE3::planar(0.05, 0, slips ? 0.2 : 0);
    const Matrix6d covariance = Matrix6d::Identity() * 1e-5;
    const DepthMotion m =
        odometry.process(camera.see(hall, T_world_body, 0.2 * i),
                         i > 0 ? std::optional(MotionGuess{wheels, covariance}) : std::nullopt);
    T_start_body = T_start_body * m.T_prev_curr_body;
  }
  const SE3 e = (start.inverse() * T_world_body).inverse() * T_start_body;
  EXPECT_LT(e.so3().log().norm(), 0.02);
  EXPECT_LT(e.translation().norm(), 0.05);
}

// A driver that sends its last image again.
TEST(DepthOdometry, AnImageThatRepeatsItselfWhileWheelsDriveTellsNothing) {
  Camera camera;
  DepthOdometry odometry;
  DepthFrame frame = camera.see(room(), SE3(), 0);
  odometry.process(frame, std::nullopt);
  frame.stamp = Timestamp::from_seconds(0.2);
  const SE3 step = SE3::planar(0.1, 0, 0);
  const DepthMotion motion =
      odometry.process(frame, MotionGuess{step, increment_covariance(OdometryModel(), step)});
  EXPECT_EQ(motion.status, ScanMotion::Status::kPredicted);
  EXPECT_LT((step.inverse() * motion.T_prev_curr_body).log().norm(), 1e-9);
}

// A lens that is covered for a moment, or an image that was left out.
TEST(DepthOdometry, AfterAnEmptyImageWhatWasSeenBeforeIsMatched) {
  Camera camera;
  DepthOdometry odometry;
  const SE3 step = SE3::planar(0.1, 0, 0);
  const MotionGuess guess{step, increment_covariance(OdometryModel(), step)};
  odometry.process(camera.see(room(), SE3(), 0), guess);
  DepthFrame empty = camera.see(room(), step, 0.2);
  std::fill(empty.raw.begin(), empty.raw.end(), std::uint16_t{0});
  EXPECT_EQ(odometry.process(empty, guess).status, ScanMotion::Status::kPredicted);
  const DepthMotion next = odometry.process(camera.see(room(), step * step, 0.4), guess);
  EXPECT_NE(next.status, ScanMotion::Status::kPredicted);
}

// One image fits turned by 40 degrees, and shifted by a metre, while wheels go on as before.
TEST(DepthOdometry, AMatchThatNoRobotCanFollowIsRejectedBesideWheelsThatGoOn) {
  const auto farthest = [](const MotionLimits& limits, const SE3& off) {
    DepthOdometryOptions options;
    options.limits = limits;
    DepthOdometry odometry(options);
    Camera camera;
    const SE3 step = SE3::planar(0.05, 0, 0);
    const MotionGuess guess{step, 1e-5 * Matrix6d::Identity()};
    double most = 0;
    for (int i = 0; i < 6; ++i) {
      const SE3 T = SE3::planar(-1 + 0.05 * i, 0, 0);
      const DepthMotion m =
          odometry.process(camera.see(room(), i == 5 ? T * off : T, 0.1 * i), guess);
      if (i > 0) most = std::max(most, (step.inverse() * m.T_prev_curr_body).log().norm());
    }
    return most;
  };
  const MotionLimits none{1e9, 0, 1e9, 0};
  for (const SE3& off : {SE3::planar(0, 0, 0.35), SE3::planar(0.35, 0, 0)}) {
    EXPECT_GT(farthest(none, off), 0.25);
    EXPECT_LT(farthest({}, off), 0.05);
  }
}

constexpr int kImages = 8;

struct Followed {
  double off = 0;   // m, at the end
  int against = 0;  // images that contradicted the wheels
};

// Five images a second of a room; wheels that are sure of themselves count `share` of the way once
// the body has gone `from` steps of it. The body pitches, images bend in waves.
Followed followed_beside(double share, int from, double pitching = 0, double waves = 0) {
  Camera camera;
  camera.waves = waves;
  DepthOdometry odometry;
  const SE3 step = SE3::planar(0.12, 0, 0.03);
  const auto pose = [&](int i) {
    return SE3::planar(-1.2, 0, 0) * SE3::exp(i * step.log()) *
           SE3(SO3::rot_y(pitching * std::sin(1.3 * i)), Eigen::Vector3d::Zero());
  };
  Followed result;
  SE3 T_start_body;
  for (int i = 0; i < kImages; ++i) {
    const SE3 wheels = SE3::exp((i < from ? 1 : share) * step.log());
    const MotionGuess guess{wheels, increment_covariance(OdometryModel(), wheels)};
    const DepthMotion m = odometry.process(camera.see(room(), pose(i), 0.2 * i), guess);
    T_start_body = T_start_body * m.T_prev_curr_body;
    result.against += m.against_wheels_m > 0;
  }
  result.off =
      ((pose(0).inverse() * pose(kImages - 1)).inverse() * T_start_body).translation().norm();
  return result;
}

// Encoders that broke: nothing moves by them, and a map made by them is metres off.
TEST(DepthOdometry, WheelsThatStandWhileImagesGoOnAreOverruled) {
  for (const int from : {1, 4}) {
    const Followed dead = followed_beside(0, from);
    EXPECT_LT(dead.off, 0.05) << from;
    EXPECT_EQ(dead.against, kImages - from) << from;
  }
}

TEST(DepthOdometry, WheelsThatAreRightAreNotOverruled) {
  EXPECT_EQ(followed_beside(1, 0).against, 0);
  EXPECT_EQ(followed_beside(0.97, 0).against, 0);
}

// Two degrees of pitch, which planar wheels do not say, contradict nothing that they do.
TEST(DepthOdometry, ABodyThatPitchesDoesNotContradictItsWheels) {
  EXPECT_EQ(followed_beside(1, 0, 0.035).against, 0);
}

// Images that bend fit nowhere: what they fit best, as the bend goes along, is no motion.
TEST(DepthOdometry, BentImagesDoNotContradictTheirWheels) {
  EXPECT_EQ(followed_beside(1, 0, 0, 1).against, 0);
}

// A camera that looks down comes round from a corner to bare floor. There every turn fits, and the
// less it turns the more of the image stays in view: wheels are right all the same.
TEST(DepthOdometry, WheelsThatTurnOverBareFloorAreBelieved) {
  const Planes corner = {{Eigen::Vector3d::UnitZ(), 0},
                         {-Eigen::Vector3d::UnitX(), -2.2},
                         {-Eigen::Vector3d::UnitY(), -2.2}};
  Camera camera;
  DepthOdometry odometry;
  const SE3 looks_down(SO3::rot_y(0.35), Eigen::Vector3d::Zero());
  SE3 T_world_robot(SO3::rot_z(1.2), Eigen::Vector3d::Zero()), T_start_body;
  const SE3 start = T_world_robot * looks_down;
  for (int i = 0; i < 16; ++i) {
    const SE3 moved = i > 0 ? SE3::planar(0, 0, 0.16) : SE3();
    T_world_robot = T_world_robot * moved;
    const MotionGuess wheels{looks_down.inverse() * moved * looks_down,
                             Matrix6d::Identity() * 1e-5};
    const DepthMotion m =
        odometry.process(camera.see(corner, T_world_robot * looks_down, 0.2 * i), wheels);
    T_start_body = T_start_body * m.T_prev_curr_body;
  }
  const SE3 e = (start.inverse() * T_world_robot * looks_down).inverse() * T_start_body;
  EXPECT_LT(e.so3().log().norm(), 0.05);
  EXPECT_LT(e.translation().norm(), 0.1);
}

// A body sways, 2 degrees to either side each second, and comes so near to a bare wall that it sees
// nothing else. What it did in the last image before does not go on for seconds.
TEST(DepthOdometry, ASwayingBodyIsNotTurnedOverBeforeAWall) {
  const Planes all = {{Eigen::Vector3d::UnitZ(), 0}, {-Eigen::Vector3d::UnitX(), -2.5}};
  const Planes wall = {all[1]};
  Camera camera;
  DepthOdometry odometry;
  const auto pose = [](int i) {
    const double roll = 2 * M_PI / 180 * std::sin(2 * M_PI * 0.1 * i);
    return SE3(SO3::rot_y(0.2) * SO3::rot_x(roll), Eigen::Vector3d(0, 0.02 * roll, 0));
  };
  SE3 T_start_body;
  for (int i = 0; i <= 30; ++i) {
    const DepthMotion m = odometry.process(camera.see(i <= 10 ? all : wall, pose(i), 0.1 * i));
    T_start_body = T_start_body * m.T_prev_curr_body;
  }
  const SE3 e = (pose(0).inverse() * pose(30)).inverse() * T_start_body;
  EXPECT_LT(e.so3().log().norm(), 0.1);
  EXPECT_LT(e.translation().norm(), 0.15);
}

// A camera that is carried along a wall and looks at it, and sways 2 cm to all sides. Its way along
// the wall goes on once the end of the wall is out of view, however the camera is held.
// m; `turned`: of the body's frame about its x.
double carried_off(double turned) {
  const Planes wall_with_end = {{-Eigen::Vector3d::UnitX(), -2.0},
                                {Eigen::Vector3d::UnitZ(), 0},
                                {-Eigen::Vector3d::UnitY(), -0.5}};
  const auto pose = [](int i) {
    const double sway = 0.02 * std::sin(0.9 * i);
    return SE3(SO3::rot_y(0.3), Eigen::Vector3d(sway, -0.05 * i + sway, sway));
  };
  const SE3 T_held_body(SO3::rot_x(turned), Eigen::Vector3d::Zero());
  Camera camera;
  DepthOdometry odometry;
  SE3 T_start_body;
  for (int i = 0; i <= 24; ++i) {
    DepthFrame frame = camera.see(wall_with_end, pose(i), 0.1 * i);
    CameraModel& model = frame.camera.camera;
    model.T_body_camera = T_held_body * model.T_body_camera;
    T_start_body = T_start_body * odometry.process(frame).T_prev_curr_body;
  }
  const SE3 moved = T_held_body.inverse() * T_start_body * T_held_body;
  return ((pose(0).inverse() * pose(24)).inverse() * moved).translation().norm();
}

TEST(DepthOdometry, WhoIsCarriedAlongAWallGoesOn) { EXPECT_LT(carried_off(0), 0.2); }

TEST(DepthOdometry, SoDoesAPortraitCamera) { EXPECT_LT(carried_off(M_PI / 2), 0.2); }

// A camera looks sideways at a wall and the floor before it, and goes on along them once the end of
// the wall is out of view. A start turned aside comes to rest further along, where more of the last
// view is in sight: more fits, of what fits anywhere.
TEST(DepthOdometry, ABareWallDoesNotSlideAside) {
  const Planes bare = {{Eigen::Vector3d::UnitZ(), 0}, {-Eigen::Vector3d::UnitY(), -2.4}};
  Planes with_end = bare;
  with_end.emplace_back(Eigen::Vector3d::UnitX(), -0.9);
  const SE3 aside(SO3::rot_z(M_PI / 2) * SO3::rot_y(0.35), Eigen::Vector3d::Zero());
  Camera camera;
  DepthOdometry odometry;
  const auto pose = [](double t) {
    return SE3(SO3::rot_z(0.05 * std::sin(2 * t)) * SO3::rot_x(0.02 * std::sin(6 * t)),
               Eigen::Vector3d(0.5 * t, 0, 0.02 * std::sin(7 * t)));
  };
  SE3 T_start_body;
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.1 * i;
    DepthFrame frame = camera.see(i < 10 ? with_end : bare, pose(t) * aside, t);
    frame.camera.camera.T_body_camera = aside * frame.camera.camera.T_body_camera;
    T_start_body = T_start_body * odometry.process(frame).T_prev_curr_body;
  }
  const SE3 e = (pose(0).inverse() * pose(2)).inverse() * T_start_body;
  EXPECT_LT(e.so3().log().norm(), 0.02);
  EXPECT_LT(e.translation().norm(), 0.1);
}

}  // namespace
}  // namespace lamina
