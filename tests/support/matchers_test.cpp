// The matchers tell alike from unlike, and say why.
#include "support/matchers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "support/random.hpp"

namespace lamina::test {
namespace {

using testing::Not;

template <typename Matcher, typename Value>
std::string said_of(const Matcher& matcher, const Value& value) {
  testing::StringMatchResultListener listener;
  testing::SafeMatcherCast<const Value&>(matcher).MatchAndExplain(value, &listener);
  return listener.str();
}

TEST(Matchers, TellAlikeFromUnlike) {
  Random random(1);
  const SO3 R = random.rotation();
  EXPECT_THAT(R, IsNear(R * SO3::rot_x(1e-10), 1e-9));
  EXPECT_THAT(R, Not(IsNear(R * SO3::rot_x(1e-8), 1e-9)));
  const SE3 T = random.pose(3);
  EXPECT_THAT(T, Not(IsNear(T * SE3::from_translation({0, 1e-8, 0}), 1e-9)));
  const Plane plane = random.plane(3);
  EXPECT_THAT(plane, IsNear(plane.boxplus({1e-10, 0, 0}), 1e-9));
  EXPECT_THAT(plane, Not(IsNear(plane.flipped(), 1e-9)));
  Moments moments;
  for (int i = 0; i < 5; ++i) moments.add(random.normal3());
  Moments more = moments;
  EXPECT_THAT(moments, IsNear(more, 0.0));
  more.add(moments.mean(), 1e-9);
  EXPECT_THAT(moments, Not(IsNear(more, 1e-3))) << "the count differs";
}

TEST(Matchers, NotANumberIsNearNothing) {
  const Eigen::Vector2d nan(std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_THAT(nan, Not(IsNear(Eigen::Vector2d(0, 0), 1e9)));
}

TEST(Matchers, SayTheDifference) {
  EXPECT_THAT(said_of(IsNear(Plane({0, 0, 1}, 1.0), 1e-9), Plane({0, 0, 1}, 1.5)),
              testing::HasSubstr("0.5"));
  EXPECT_THAT(testing::PrintToString(Plane({0, 0, 1}, 1.5)), testing::HasSubstr("rho 1.5"));
}

TEST(Random, IsTheSameForTheSameSeed) {
  Random a(7), b(7), c(8);
  const Eigen::Vector3d va = a.normal3();
  EXPECT_EQ(va, b.normal3());
  EXPECT_NE(va, c.normal3());
}

TEST(Random, PointsLieOnTheirPlane) {
  Random random(3);
  const Plane plane = random.plane(5);
  for (const auto& point : random.points_on(plane, {1, 2, 3}, 2.0, 20)) {
    EXPECT_NEAR(plane.signed_distance(point), 0, 1e-12);
    EXPECT_LE((point - plane.project({1, 2, 3})).norm(), 2.0 + 1e-12);
  }
}

}  // namespace
}  // namespace lamina::test
