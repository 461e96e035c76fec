// Trajectories: order, interpolation, TUM text.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include <lamina/models/error.hpp>
#include <lamina/models/trajectory.hpp>

#include "support/matchers.hpp"
#include "support/random.hpp"

namespace lamina::test {
namespace {

Timestamp at(double seconds) { return Timestamp::from_seconds(seconds); }

std::string error_of(const std::string& text) {
  std::istringstream in(text);
  try {
    Trajectory::read_tum(in, "t.txt");
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Trajectory, KeepsTimesIncreasing) {
  Trajectory trajectory;
  EXPECT_TRUE(trajectory.empty());
  EXPECT_TRUE(trajectory.add(at(1), SE3()));
  EXPECT_FALSE(trajectory.add(at(1), SE3()));
  EXPECT_FALSE(trajectory.add(at(0.5), SE3()));
  EXPECT_TRUE(trajectory.add(at(1.1), SE3()));
  EXPECT_EQ(trajectory.size(), 2u);
}

TEST(Trajectory, InterpolatesBetweenNeighbours) {
  Trajectory trajectory;
  EXPECT_FALSE(trajectory.at(at(1)));
  trajectory.add(at(1), SE3::planar(0, 0, 0));
  trajectory.add(at(2), SE3::planar(0, 0, 1));
  trajectory.add(at(4), SE3(SO3::rot_z(1), {4, 0, 0}));
  EXPECT_FALSE(trajectory.at(at(0.99)));
  EXPECT_FALSE(trajectory.at(at(4.01)));
  EXPECT_THAT(*trajectory.at(at(1)), IsNear(SE3::planar(0, 0, 0), 0.0));
  EXPECT_THAT(*trajectory.at(at(1.25)), IsNear(SE3::planar(0, 0, 0.25), 1e-9));
  EXPECT_THAT(*trajectory.at(at(3)), IsNear(SE3(SO3::rot_z(1), {2, 0, 0}), 1e-9));
  EXPECT_THAT(*trajectory.at(at(4)), IsNear(SE3(SO3::rot_z(1), {4, 0, 0}), 0.0));
  EXPECT_FALSE(trajectory.at(at(3), 1.5)) << "the gap is 2 s";
  EXPECT_TRUE(trajectory.at(at(4), 1.5)) << "a pose itself needs no neighbours";
  EXPECT_NEAR(trajectory.length(), 4, 1e-15);
}

TEST(Trajectory, TumLinesAreExact) {
  Trajectory trajectory;
  trajectory.add(*Timestamp::parse("1341836538.891350"), SE3(SO3::rot_z(M_PI / 2), {1, -2, 0.5}));
  std::ostringstream out;
  trajectory.write_tum(out);
  EXPECT_EQ(out.str(),
            "1341836538.891350 1.000000000 -2.000000000 0.500000000 "
            "0.000000000 0.000000000 0.707106781 0.707106781\n");
}

TEST(Trajectory, ReadsWhatItWrote) {
  Random random(1);
  Trajectory trajectory;
  for (int i = 0; i < 100; ++i) {
    trajectory.add(Timestamp::from_nanoseconds(1341836538891350000 + std::int64_t{33333333} * i),
                   random.pose(100));
  }
  std::stringstream text;
  trajectory.write_tum(text);
  const Trajectory back = Trajectory::read_tum(text, "memory");
  ASSERT_EQ(back.size(), trajectory.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].stamp, trajectory[i].stamp);
    EXPECT_THAT(back[i].pose, IsNear(trajectory[i].pose, 1e-8));
  }
}

TEST(Trajectory, ReadsCommentsTabsAndWindowsLineEnds) {
  std::istringstream in(
      "# a comment\r\n\r\n1 0 0 0 0 0 0 1\r\n  \n2\t1 0 0  0 0 0 1 \n3 +2 0 0 0 0 0 1");
  const Trajectory trajectory = Trajectory::read_tum(in, "t.txt");
  ASSERT_EQ(trajectory.size(), 3u);
  EXPECT_EQ(trajectory[2].pose.translation().x(), 2);
}

TEST(Trajectory, SaysWhatIsWrongAndWhere) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  EXPECT_EQ(error_of(good + "2 0 0 0 0 0 1\n"),
            "t.txt:2: found 7 columns, expected 8: timestamp tx ty tz qx qy qz qw");
  EXPECT_EQ(error_of("x 0 0 0 0 0 0 1\n"), "t.txt:1: found 'x', expected a time in seconds");
  EXPECT_EQ(error_of("1 0 0 zero 0 0 0 1\n"), "t.txt:1: found 'zero', expected a finite number");
  EXPECT_EQ(error_of("1 0 0 nan 0 0 0 1\n"), "t.txt:1: found 'nan', expected a finite number");
  EXPECT_EQ(error_of("1 0 0 0 0 0 0 0\n"),
            "t.txt:1: found a quaternion of length 0.000000, expected length 1");
  EXPECT_EQ(error_of(good + good),
            "t.txt:2: found time 1 not after the line before, expected increasing times");
  EXPECT_THROW(Trajectory::read_tum(std::filesystem::path("/nonexistent/t.txt")), Error);
}

}  // namespace
}  // namespace lamina::test
