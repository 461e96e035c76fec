// A path of corrected stamps, asked for at those of the recording.
#include <gtest/gtest.h>

#include <lamina/sensors/recorded_stamps.hpp>

namespace lamina {
namespace {

// 0.5 m/s and 0.4 rad/s.
SE3 pose_at(double s) { return SE3::exp((Vector6d() << 0.5 * s, 0, 0, 0, 0, 0.4 * s).finished()); }

TEST(RecordedStamps, ABodyIsWhereItWasThen) {
  Trajectory path;
  std::set<Timestamp> scans;
  // Scans said to be 40 ms later than they were, images 5 ms: 0.1 s apart, in turn.
  for (int k = 0; k < 20; ++k) {
    const Timestamp stamp = Timestamp::from_seconds(10 + 0.05 * k);
    if (k % 2 == 0) scans.insert(stamp);
    path.add(stamp, pose_at(0.05 * k));
  }
  const Trajectory recorded = at_recorded_stamps(path, {-0.04, -0.005, 0}, scans);
  ASSERT_EQ(recorded.size(), path.size());
  for (std::size_t k = 0; k < path.size(); ++k) {
    const double late = k % 2 == 0 ? 0.04 : 0.005, s = 0.05 * static_cast<double>(k) + late;
    EXPECT_EQ(recorded[k].stamp, path[k].stamp + late);
    EXPECT_LT((recorded[k].pose.inverse() * pose_at(s)).log().norm(), 1e-9) << k;
  }
}

TEST(RecordedStamps, RightClocksLeaveThePathAsItIs) {
  Trajectory path;
  path.add(Timestamp::from_seconds(1), pose_at(0));
  const Trajectory recorded = at_recorded_stamps(path, {0, 0, -0.03}, {});
  ASSERT_EQ(recorded.size(), 1u);
  EXPECT_EQ(recorded[0].stamp, path[0].stamp);
  EXPECT_EQ(at_recorded_stamps(path, {-0.03, -0.03, 0}, {})[0].stamp, path[0].stamp + 0.03);
}

}  // namespace
}  // namespace lamina
