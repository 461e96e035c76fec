// Images' motions made up beside wheels' of a body in which the camera sits elsewhere.
#include <gtest/gtest.h>

#include <random>

#include <lamina/pipeline/calibration/camera/camera_hand_eye.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
const Eigen::Vector2d kSaid(0.3, 0.1);

// Bends, an image each 5 cm, a key frame every fifth, by a camera whose frame is off the wheels'.
struct Drive {
  std::mt19937 rng;
  std::normal_distribution<double> normal{0, 1};
  CameraAgainstWheels camera{kSaid};
  SE3 T_wheels_camera_frame;  // of the frame in which the camera is said to sit
  double turning = 0.06, wheel_noise = 0.001;
  double sway = 0;  // m an image, across: what a tilt that lasts for a second or two does
  ScanMotion::Status status = ScanMotion::Status::kTracked;
  bool doubtful = false;
  Matrix6d information = (Vector6d() << 1e6, 1e6, 1e6, 1e6, 1e6, 1e6).finished().asDiagonal();

  Drive(unsigned seed, const SE3& T) : rng(seed), T_wheels_camera_frame(T) {}

  double swaying = 0;  // of standard deviation 1
  DepthMotion image(const SE3& moved, bool key_frame) {
    DepthMotion m;
    constexpr double kKept = 1 - 1 / 10.0;
    swaying = kKept * swaying + std::sqrt(1 - kKept * kKept) * normal(rng);
    m.T_prev_curr_body =
        T_wheels_camera_frame.inverse() * moved * T_wheels_camera_frame *
        SE3::planar(0.0005 * normal(rng), 0.0005 * normal(rng) + sway * swaying, 0);
    m.status = status;
    m.doubtful = doubtful;
    m.image_information = information;
    m.key_frame = key_frame;
    return m;
  }
  void go(int steps) {
    DepthMotion first;
    first.key_frame = true;
    camera.add(Timestamp(), std::nullopt, first);
    Matrix6d C = 1e-9 * Matrix6d::Identity();
    C.diagonal()(0) = C.diagonal()(1) = C.diagonal()(5) = wheel_noise * wheel_noise;
    for (int i = 1; i <= steps; ++i) {
      const SE3 moved = SE3::planar(0.05, 0, turning * std::sin(0.1 * i));
      const SE3 observed =
          moved * SE3::planar(0.001 * normal(rng), 0.001 * normal(rng), 0.001 * normal(rng));
      camera.add(Timestamp::from_seconds(0.1 * i), Increment{observed, C},
                 image(moved, i % 5 == 0));
    }
  }
};

TEST(CameraAgainstWheels, TellsHeadingAndPlace) {
  // Turned by 2 degrees about itself, and 2 cm off.
  const SO3 turned = SO3::rot_z(2 * kDegree);
  const Eigen::Vector3d said(kSaid.x(), kSaid.y(), 0), off(0.02, -0.015, 0);
  Drive drive(1, SE3(turned, said + off - turned * said));
  drive.go(800);
  const auto found = drive.camera.correction();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->correction.rotation_body.z(), 2 * kDegree, 0.3 * kDegree);
  EXPECT_LT((found->correction.translation_body - off).norm(), 0.006);
}

// Left as it is, the error is within what the evidence says.
TEST(CameraAgainstWheels, EvidenceHoldsTheError) {
  for (unsigned seed = 0; seed < 2; ++seed) {
    Drive drive(40 + seed, SE3(SO3::rot_z(1 * kDegree), {0.01, -0.01, 0}));
    drive.go(800);
    const MountingEvidence evidence = drive.camera.evidence();
    const Eigen::Vector3d left = evidence.information.ldlt().solve(evidence.pull);
    const Eigen::Vector3d off = left - Eigen::Vector3d(0.01, -0.01, 1 * kDegree);
    EXPECT_LT(off.dot(evidence.information * off), 16.3) << left.transpose();
    EXPECT_GT(evidence.information(2, 2), 1 / std::pow(0.8 * kDegree, 2));
  }
  EXPECT_TRUE(Drive(9, SE3()).camera.evidence().information.isZero(0));
}

TEST(CameraAgainstWheels, OnAStraightWayThePlaceStays) {
  Drive drive(2, SE3(SO3::rot_z(2 * kDegree), {0.02, -0.015, 0}));
  drive.turning = 0;
  drive.go(400);
  const auto found = drive.camera.correction();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->correction.rotation_body.z(), 2 * kDegree, 0.4 * kDegree);
  EXPECT_LT(found->correction.translation_body.norm(), 1e-4);
}

TEST(CameraAgainstWheels, RightMountingsStay) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Drive drive(100 + seed, SE3());
    drive.go(400);
    EXPECT_FALSE(drive.camera.correction()) << seed;
  }
}

// Neighbouring images share the tilt of the ground: their number says nothing of how well they
// tell a heading.
TEST(CameraAgainstWheels, SharedErrorsOfImagesTurnNoCamera) {
  int turned = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    Drive drive(200 + seed, SE3());
    drive.sway = 0.003;
    drive.go(800);
    turned += drive.camera.correction().has_value();
  }
  EXPECT_LE(turned, 1);
}

// What an image leaves open is the wheels' own word, which says nothing of them.
TEST(CameraAgainstWheels, OpenDirectionsTellNothing) {
  Drive drive(3, SE3(SO3::rot_z(3 * kDegree), {0, 0, 0}));
  drive.turning = 0;
  drive.information = (Vector6d() << 1e6, 0, 1e6, 1e6, 1e6, 1e6).finished().asDiagonal();
  drive.go(400);
  EXPECT_FALSE(drive.camera.correction());
}

// A wall seen obliquely holds neither component of the way alone, but one direction between them:
// one to the left and one to the right tell scale and heading.
TEST(CameraAgainstWheels, ObliqueWallsTellTheHeading) {
  Drive drive(8, SE3(SO3::rot_z(3 * kDegree), {0, 0, 0}));
  drive.turning = 0;
  drive.information.topLeftCorner<2, 2>() << 5e5, -5e5, -5e5, 5e5;
  drive.go(400);
  drive.information.topLeftCorner<2, 2>() << 5e5, 5e5, 5e5, 5e5;
  drive.go(400);
  const auto found = drive.camera.correction();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->correction.rotation_body.z(), 3 * kDegree, 0.6 * kDegree);
}

// An error of many sigmas of good wheels is no outlier.
TEST(CameraAgainstWheels, GoodWheelsTellALargeError) {
  Drive drive(6, SE3(SO3::rot_z(4 * kDegree), {0, 0, 0}));
  drive.wheel_noise = 0.0002;
  drive.turning = 0;
  drive.go(400);
  const auto found = drive.camera.correction();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->correction.rotation_body.z(), 4 * kDegree, 0.6 * kDegree);
}

TEST(CameraAgainstWheels, ShortWaysAndLostImagesTellNothing) {
  const SE3 off(SO3::rot_z(3 * kDegree), {0, 0, 0});
  Drive brief(4, off), lost(4, off), doubtful(4, off);
  brief.go(20);
  EXPECT_FALSE(brief.camera.correction());
  lost.status = ScanMotion::Status::kPredicted;
  lost.go(400);
  EXPECT_FALSE(lost.camera.correction());
  doubtful.doubtful = true;
  doubtful.go(400);
  EXPECT_FALSE(doubtful.camera.correction());
}

}  // namespace
}  // namespace lamina
