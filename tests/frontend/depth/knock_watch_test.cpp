// A knocked camera and a carpet's edge.
#include <gtest/gtest.h>

#include <lamina/frontend/depth/knock_watch.hpp>

namespace lamina {
namespace {

SE3 at(double x) { return SE3::planar(x, 0, 0); }

TEST(KnockWatch, WhatIsOffForTwoMetresOfWayIsAnEdge) {
  KnockWatch watch;
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(watch.may_be(false, at(0.05 * i)));
  for (int i = 20; i < 60; ++i) EXPECT_FALSE(watch.may_be(true, at(0.05 * i))) << i;
  EXPECT_TRUE(watch.may_be(false, at(3.0)));
}

TEST(KnockWatch, WhatIsOffForLongIsAKnock) {
  KnockWatch watch;
  watch.may_be(false, at(0));
  for (double x = 0.05; x < 2.95; x += 0.05) EXPECT_FALSE(watch.may_be(true, at(x)));
  EXPECT_TRUE(watch.may_be(true, at(3.05)));
}

TEST(KnockWatch, NobodyTiltsWhileItStands) {
  KnockWatch watch;
  watch.may_be(false, at(1));
  watch.may_be(false, at(2));
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(watch.may_be(true, at(2)));
  EXPECT_TRUE(watch.may_be(true, at(2.5)));
  // Nor does it where it stopped after its floor went off.
  KnockWatch stopped;
  stopped.may_be(false, at(1));
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(stopped.may_be(true, at(1.05)));
}

}  // namespace
}  // namespace lamina
