// How a recording of images alone begins whose first one shows no floor.
#include <gtest/gtest.h>

#include <lamina/pipeline/path_correction.hpp>

namespace lamina {
namespace {

constexpr double kTilt = 0.3, kHeight = 1.4;  // rad, m

// A camera carried ahead at kHeight that looks down by kTilt; its i-th image alone shows the floor.
std::vector<Step> carried(std::size_t floor_at) {
  const SE3 T_level_body(SO3::rot_y(kTilt), {0, 0, kHeight});
  std::vector<Step> steps(4);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const SE3 T_level_i = SE3::planar(0.1 * static_cast<double>(i), 0, 0.2) * T_level_body;
    const SE3 T_level_0 = SE3::planar(0, 0, 0.2) * T_level_body;
    steps[i].T_start_body = T_level_0.inverse() * T_level_i;
    if (i > 0)
      steps[i].motion.T_from_to = steps[i - 1].T_start_body.inverse() * steps[i].T_start_body;
    if (i == floor_at) steps[i].T_body_levelled = T_level_body.inverse();
  }
  return steps;
}

TEST(BeginLevelled, ByTheFirstImageThatShowsTheFloor) {
  std::vector<Step> steps = carried(2);
  const SE3 moved = steps[1].motion.T_from_to;
  ASSERT_TRUE(begin_levelled(steps));
  const SE3& T_map_first = steps[0].motion.T_from_to;
  EXPECT_LT((T_map_first.translation() - Eigen::Vector3d(0, 0, kHeight)).norm(), 1e-9);
  EXPECT_LT((T_map_first.so3().inverse() * SO3::rot_y(kTilt)).log().norm(), 1e-9);
  EXPECT_LT((T_map_first.inverse() * steps[0].T_start_body).log().norm(), 1e-9);
  EXPECT_LT((steps[1].motion.T_from_to.inverse() * moved).log().norm(), 1e-12);
  EXPECT_NEAR(steps[3].T_start_body.translation().z(), kHeight, 1e-9);
}

TEST(BeginLevelled, NotWhereNoneDoes) {
  std::vector<Step> steps = carried(9);
  EXPECT_FALSE(begin_levelled(steps));
  EXPECT_LT(steps[0].motion.T_from_to.log().norm(), 1e-12);
}

}  // namespace
}  // namespace lamina
