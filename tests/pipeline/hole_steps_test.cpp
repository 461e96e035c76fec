// Wheels count across a hole of their messages, whatever was guessed inside it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <lamina/frontend/frontend.hpp>
#include <lamina/pipeline/hole_steps.hpp>

namespace lamina {
namespace {

Timestamp at(double seconds) { return Timestamp::from_seconds(1000 + seconds); }

// Along an arc.
SE3 pose(double t) { return SE3::exp((Vector6d() << 0.5 * t, 0, 0, 0, 0, 0.4 * t).finished()); }

LaserScan blind(double seconds) {
  LaserScan scan;
  scan.stamp = at(seconds);
  scan.angle_min = -1.5;
  scan.angle_increment = 0.05;
  scan.range_min = 0.1;
  scan.range_max = 20;
  scan.ranges.assign(61, std::numeric_limits<float>::infinity());
  return scan;
}

// Odometry is silent from 2 to 5 s; a scan lies inside.
TEST(HoleOfOdometry, IsCountedAcrossWhereAScanLiesInside) {
  FrontEnd front_end({}, Calibration());
  Diagnostics metrics;
  SE3 last;
  for (int k = 0; k <= 70; ++k) {
    const double t = 0.1 * k;
    if (k <= 20 || k >= 50) front_end.process(Odometry{at(t), pose(t)}, metrics);
    if (k > 20 && k < 50 && k != 33) continue;
    if (const auto step = front_end.process(blind(t), metrics)) last = step->T_start_body;
  }
  EXPECT_LT((last.inverse() * pose(7)).log().norm(), 0.01);
}

Step step(double t, const SE3& T_start_body, bool lost) {
  Step step;
  step.observations.stamp = at(t);
  step.T_start_body = T_start_body;
  step.tracking_lost = lost;
  step.motion_known = !lost;
  return step;
}

TEST(HoleOfOdometry, LostImagesAreLaidAlongTheWay) {
  std::vector<Step> steps{step(0, pose(0), false), step(1, pose(1), false),
                          step(2, pose(1.5), true), step(3, pose(1.5), true),
                          step(4, pose(4), false)};
  steps[4].across_hole = 2;
  EXPECT_EQ(lay_across_holes(steps), 2);
  SE3 T = pose(1);
  for (std::size_t k = 2; k <= 4; ++k) {
    T = T * steps[k].motion.T_from_to;
    EXPECT_LT((T.inverse() * pose(static_cast<double>(k))).log().norm(), 1e-9) << k;
    EXPECT_FALSE(steps[k].tracking_lost);
    EXPECT_TRUE(steps[k].motion_known);
  }
}

TEST(HoleOfOdometry, StepsThatImagesToldStay) {
  std::vector<Step> steps{step(0, pose(0), false), step(1, pose(1.1), false),
                          step(2, pose(2), false)};
  steps[2].across_hole = 1;
  EXPECT_EQ(lay_across_holes(steps), 0);
  EXPECT_LT((steps[1].T_start_body.inverse() * pose(1.1)).log().norm(), 1e-12);
}

}  // namespace
}  // namespace lamina
