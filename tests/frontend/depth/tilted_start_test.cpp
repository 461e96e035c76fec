// What the floors of a way say of its start.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include <lamina/frontend/depth/mounting_tracker.hpp>
#include <lamina/frontend/depth/tilted_start.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
const SE3 kMounting = testing::test_camera().camera.T_body_camera;

// `pitch_deg` of floors against the calibration over 10 m; the body stands for the first ten.
std::optional<TiltedStart> watched(const std::function<double(double way)>& pitch_deg) {
  StartWatch watch(kMounting);
  for (int i = 0; i < 210; ++i) {
    const double way = 0.05 * std::max(0, i - 10);
    const double noise = 0.03 * std::sin(2.4 * i);
    watch.add({noise * kDegree, (pitch_deg(way) + noise) * kDegree, 0.8}, way);
  }
  return watch.result();
}

TEST(TiltedStart, IsToldByTheWayThatFollows) {
  const auto found = watched([](double way) { return way < 0.4 ? -2.5 : 0.5; });
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->usual.pitch / kDegree, 0.5, 0.05);
  EXPECT_NEAR(found->start.pitch / kDegree, -2.5, 0.05);
  // The floor seems to fall away ahead: the body looks up.
  const Eigen::Vector3d forward = found->T_level_body().so3() * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::asin(forward.z()) / kDegree, 3, 0.1);
  EXPECT_NEAR(found->T_level_body().so3().yaw(), 0, 1e-9);
}

TEST(TiltedStart, IsNoneWhereTheCameraIsMountedSo) {
  EXPECT_FALSE(watched([](double) { return -2.5; }));
  // Nor where it is knocked later, wherever that is.
  EXPECT_FALSE(watched([](double way) { return way < 2.5 ? -2.5 : 0; }));
  EXPECT_FALSE(watched([](double way) { return way < 7 ? 0 : 2.5; }));
}

TEST(TiltedStart, IsNotToldByGroundThatIsUnevenAllOver) {
  EXPECT_FALSE(watched([](double way) { return way < 0.4 ? -2.5 : 3 * std::sin(2 * way); }));
  // A ramp, driven up for long: half of the way is as good as the other.
  EXPECT_FALSE(watched([](double way) { return way < 0.4 ? -2.5 : way < 5 ? 0 : -2.5; }));
}

TEST(TiltedStart, NeedsSomeWay) {
  StartWatch watch(kMounting);
  for (int i = 0; i < 200; ++i) watch.add({0, (i < 20 ? 3 : 0) * kDegree, 0.8}, 0.002 * i);
  EXPECT_TRUE(watch.wants_more());
  EXPECT_FALSE(watch.result());
}

// The mounting that the way told is not given up for the tilt the first images see.
TEST(TiltedStart, IsNoMounting) {
  const auto found = watched([](double way) { return way < 0.4 ? -2.5 : 0; });
  ASSERT_TRUE(found);
  MountingTracker tracker{FloorOptions()};
  tracker.begin(kMounting, found->usual);
  tracker.accept_knocks(false);
  const Eigen::Matrix3d noise = Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal();
  const auto see = [&](const Leveling& l) {
    tracker.update(kMounting, apply(l, kMounting).inverse() * Plane(), noise);
  };
  for (int i = 0; i < 40; ++i) see(found->start);
  EXPECT_NEAR(tracker.estimate().pitch / kDegree, 0, 0.1);
  // Ground is no better a level than 0.1 degrees: that does not contradict it. 0.6 for long do.
  for (int i = 0; i < 10; ++i) see({0, 0.1 * kDegree, 0.8});
  EXPECT_NEAR(tracker.estimate().pitch, found->usual.pitch, 1e-9);
  for (int i = 0; i < 240; ++i) see({0, 0.6 * kDegree, 0.8});
  EXPECT_NEAR(tracker.estimate().pitch / kDegree, 0.6, 0.1);
}

}  // namespace
}  // namespace lamina
