// Loops of scans between keyframes that stand level, and that tilt.
#include <gtest/gtest.h>

#include <lamina/pipeline/loop_factors.hpp>

namespace lamina {
namespace {

Timestamp stamp(int i) { return Timestamp::from_seconds(1000 + i); }

// A drive of which the third keyframe is at the place of the first, and what `loop` becomes.
LoopFactor handed_over(const std::vector<SE3>& poses, const Eigen::Vector3d& up_body,
                       const LoopClosure& loop) {
  MapperOptions options;
  options.reuse_distance_m = 0;
  Mapper mapper(options);
  LoopBook book;
  const Matrix6d C = 1e-6 * Matrix6d::Identity();
  for (int i = 0; i < static_cast<int>(poses.size()); ++i) {
    const auto k = static_cast<std::size_t>(i);
    Observations none;
    none.stamp = stamp(i);
    none.up_body = up_body;
    const SE3 moved = i == 0 ? poses[0] : poses[k - 1].inverse() * poses[k];
    book.note(none, mapper.add(none, moved, C), mapper);
  }
  EXPECT_EQ(book.transfer({loop}, mapper), 1);
  EXPECT_FALSE(mapper.graph().loops.empty());
  return mapper.graph().loops.back();
}

LoopClosure flat_loop() {
  LoopClosure loop;
  loop.from = stamp(0);
  loop.to = stamp(2);
  loop.T_from_to = SE3::planar(0.3, -0.1, 0.2);
  loop.covariance = 1e-4 * Matrix6d::Identity();
  return loop;
}

double sigma(const LoopFactor& factor, int k) {
  const Matrix6d H = factor.sqrt_information.transpose() * factor.sqrt_information;
  return std::sqrt(H.inverse()(k, k));
}

TEST(LoopBook, LevelLoopsStayAsTheyAre) {
  const auto factor = handed_over({SE3(), SE3::planar(1, 0, 0), SE3::planar(0.3, -0.1, 0.2)},
                                  Eigen::Vector3d::UnitZ(), flat_loop());
  EXPECT_LT((factor.T_from_to.inverse() * flat_loop().T_from_to).log().norm(), 1e-12);
  EXPECT_NEAR(sigma(factor, 2), 0.01, 1e-6);
}

TEST(LoopBook, LoopsOnSlopesTakeTiltAndHeightOfTheMap) {
  const SO3 tilt = SO3::rot_y(-0.09);  // climbs along x
  const SE3 first(tilt, {0, 0, 0.2}), second(tilt, {1, 0, 0.29});
  const SE3 third(SO3::rot_z(0.2) * tilt, {0.3, -0.1, 0.23});
  const auto factor =
      handed_over({first, second, third}, tilt.inverse() * Eigen::Vector3d::UnitZ(), flat_loop());
  EXPECT_LT((factor.T_from_to.inverse() * (first.inverse() * third)).log().norm(), 1e-3);
  EXPECT_LT(sigma(factor, 0), 0.06);
  EXPECT_GT(sigma(factor, 2), 0.4);  // the scans say nothing of it
  EXPECT_GT(sigma(factor, 4), 0.09);
}

}  // namespace
}  // namespace lamina
