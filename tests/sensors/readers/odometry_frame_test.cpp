// Poses written in another frame or order, and what is left alone.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/sensors/readers/odometry_frame.hpp>

namespace lamina {
namespace {

// Twice round a rectangle with round corners, as a robot that steers drives it.
std::vector<Odometry> drive(int turn = 16) {
  std::vector<Odometry> all;
  SE3 T;
  for (int i = 0; i < 400; ++i) {
    all.push_back({Timestamp::from_seconds(0.1 * i), T});
    T = T * SE3::planar(0.06, 0, i % 50 < turn ? M_PI_2 / turn : 0);
  }
  return all;
}

void expect_mended(const std::vector<Odometry>& spoiled, const std::optional<SE3>& T_body_camera,
                   const char* id) {
  std::vector<Odometry> samples = spoiled;
  const auto warnings = mend_odometry_frame(samples, T_body_camera);
  ASSERT_EQ(warnings.size(), 1);
  EXPECT_EQ(warnings[0].id, id);
  const auto right = drive();
  const SE3 T_right_mended = right[0].T_odom_body * samples[0].T_odom_body.inverse();
  for (std::size_t i = 0; i < right.size(); ++i) {
    const SE3 off = (T_right_mended * samples[i].T_odom_body).inverse() * right[i].T_odom_body;
    EXPECT_LT(off.log().norm(), 1e-6) << i;
  }
}

TEST(OdometryFrame, LeavesWhatIsRightAlone) {
  std::vector<Odometry> samples = drive();
  EXPECT_TRUE(mend_odometry_frame(samples, std::nullopt).empty());
  // A body that moves sideways whichever way it faces steers not.
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double way = 0.06 * static_cast<double>(i), yaw = samples[i].T_odom_body.so3().yaw();
    samples[i].T_odom_body = SE3::planar(way, 0.3 * std::sin(way), yaw);
  }
  EXPECT_TRUE(mend_odometry_frame(samples, std::nullopt).empty());
}

TEST(OdometryFrame, ReadsQuaternionsWithWFirst) {
  std::vector<Odometry> samples = drive();
  for (Odometry& o : samples) {
    const Eigen::Quaterniond q = o.T_odom_body.so3().quaternion();
    o.T_odom_body =
        SE3(SO3(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y())), o.T_odom_body.translation());
  }
  expect_mended(samples, std::nullopt, "odometry_frame");
}

TEST(OdometryFrame, ReadsPosesOfTheCamerasOpticalFrame) {
  const SE3 T_body_camera(SO3::rot_y(0.4) * SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)),
                          {0.2, 0, 0.6});
  std::vector<Odometry> samples = drive();
  for (Odometry& o : samples) o.T_odom_body = o.T_odom_body * T_body_camera;
  expect_mended(samples, T_body_camera, "odometry_frame");
  EXPECT_TRUE(mend_odometry_frame(samples, std::nullopt).empty());
}

TEST(OdometryFrame, MirrorsPositionsThatTurnAgainstHeadings) {
  std::vector<Odometry> swapped = drive(), negated = drive();
  for (Odometry& o : swapped) {
    const Eigen::Vector3d p = o.T_odom_body.translation();
    o.T_odom_body = SE3(o.T_odom_body.so3(), {p.y(), p.x(), p.z()});
  }
  for (Odometry& o : negated) {
    const Eigen::Vector3d p = o.T_odom_body.translation();
    o.T_odom_body = SE3(o.T_odom_body.so3(), {p.x(), -p.y(), p.z()});
  }
  expect_mended(swapped, std::nullopt, "odometry_axes");
  expect_mended(negated, std::nullopt, "odometry_axes");
}

// Of a rectangle with sharp corners, mirrored positions have the robot drive sideways, or ahead and
// backwards in turns, both of which robots do.
TEST(OdometryFrame, SharpCornersAreTold) {
  std::vector<Odometry> samples = drive(4);
  EXPECT_TRUE(mend_odometry_frame(samples, std::nullopt).empty());
  for (Odometry& o : samples) {
    const Eigen::Vector3d p = o.T_odom_body.translation();
    o.T_odom_body = SE3(o.T_odom_body.so3(), {p.y(), p.x(), p.z()});
  }
  EXPECT_EQ(mend_odometry_frame(samples, std::nullopt).size(), 1);
  // A robot that drives backwards half of the time, and one whose x looks to the left.
  const std::vector<Odometry> driven = drive(4);
  std::vector<Odometry> back = driven, left = driven;
  for (std::size_t i = 0; i < back.size(); ++i) back[i].T_odom_body = driven[399 - i].T_odom_body;
  for (Odometry& o : left) o.T_odom_body = o.T_odom_body * SE3::planar(0, 0, M_PI_2);
  EXPECT_TRUE(mend_odometry_frame(back, std::nullopt).empty());
  EXPECT_TRUE(mend_odometry_frame(left, std::nullopt).empty());
}

TEST(OdometryFrame, NumbersMayBeOffByAHalf) {
  for (const double k : {0.5, 1.5}) {
    OdometryFrameOptions options;
    options.upright *= k;
    options.step *= k;
    options.least_turned *= k;
    options.against = std::min(0.95, k * options.against);
    options.quarter *= k;
    std::vector<Odometry> samples = drive();
    EXPECT_TRUE(mend_odometry_frame(samples, std::nullopt, options).empty());
    for (Odometry& o : samples) {
      const Eigen::Vector3d p = o.T_odom_body.translation();
      o.T_odom_body = SE3(o.T_odom_body.so3(), {p.y(), p.x(), p.z()});
    }
    EXPECT_EQ(mend_odometry_frame(samples, std::nullopt, options).size(), 1);
  }
}

}  // namespace
}  // namespace lamina
