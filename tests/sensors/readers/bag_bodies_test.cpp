// Whose odometry it is, of several bodies in one bag.
#include <gtest/gtest.h>

#include <lamina/sensors/readers/bag_bodies.hpp>

namespace lamina {
namespace {

const SE3 kMount = SE3::planar(0.2, 0, 0.4);

Odometry at(int i, double x) { return {Timestamp::from_seconds(i), SE3::planar(x, 0, 0)}; }

TEST(BagBodies, TheBodyThatCarriesTheSensorCounts) {
  BagBodies bodies;
  for (int i = 0; i < 20; ++i) {
    bodies.add_transform("odom", "base_link", SE3::planar(i, 0, 0), false, at(i, 0).stamp);
    bodies.add_transform("odom", "robot2/base_link", SE3::planar(0, i, 0), false, at(i, 0).stamp);
    bodies.add_transform("odom", "robot2/base_link", SE3::planar(0, i, 0), false, at(i, 0.5).stamp);
  }
  bodies.add_transform("base_link", "laser", kMount, true, {});
  bodies.add_transform("robot2/base_link", "robot2/laser", SE3(), true, {});
  const auto chosen = bodies.choose("laser", "");
  EXPECT_EQ(chosen.frame, "base_link");
  EXPECT_EQ(chosen.odometry.size(), 20u);
  ASSERT_EQ(chosen.warnings.size(), 1u);
  EXPECT_EQ(chosen.warnings[0].id, "two_robots");
  EXPECT_NE(chosen.warnings[0].text.find("'robot2/base_link'"), std::string::npos);
  const auto T = bodies.tree().lookup(chosen.frame, "laser");
  ASSERT_TRUE(T);
  EXPECT_LT((T->inverse() * kMount).log().norm(), 1e-9);
}

TEST(BagBodies, TwoFramesOfOneRobotAreNoTwoRobots) {
  BagBodies bodies;
  for (int i = 0; i < 20; ++i) {
    bodies.add_transform("odom", "base_footprint", SE3::planar(i, 0, 0), false, at(i, 0).stamp);
    bodies.add_odometry("/odom", "base_link", at(i, i));
  }
  bodies.add_transform("base_footprint", "base_link", SE3(), true, {});
  bodies.add_transform("base_link", "laser", kMount, false, {});
  const auto chosen = bodies.choose("laser", "");
  EXPECT_EQ(chosen.frame, "base_link");
  EXPECT_EQ(chosen.topic, "/odom");
  EXPECT_TRUE(chosen.warnings.empty());
}

TEST(BagBodies, AnOdometryTopicOfTheOtherRobotIsLeftOut) {
  BagBodies bodies;
  for (int i = 0; i < 20; ++i) {
    bodies.add_odometry("/robot1/odom", "robot1/base_link", at(i, i));
    bodies.add_odometry("/robot2/odom", "robot2/base_link", at(i, -i));
    bodies.add_odometry("/robot2/odom", "robot2/base_link", at(i + 100, -i));
  }
  bodies.add_transform("robot1/base_link", "robot1/laser", kMount, true, {});
  const auto chosen = bodies.choose("robot1/laser", "");
  EXPECT_EQ(chosen.topic, "/robot1/odom");
  EXPECT_EQ(chosen.other_topics, std::vector<std::string>{"/robot2/odom"});
  EXPECT_EQ(chosen.warnings.size(), 1u);
  EXPECT_EQ(bodies.choose("robot1/laser", "/robot2/odom").topic, "/robot2/odom");  // as asked for
}

}  // namespace
}  // namespace lamina
