// A robot that stands on the edge of a carpet where its recording begins.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/frontend/frontend.hpp>
#include <lamina/pipeline/calibration/initial_attitude.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
Timestamp at(double seconds) { return Timestamp::from_seconds(1000 + seconds); }

// Stands for 2 s, then drives 6 m at 1 m/s; its nose is up by `tilt` for the first 0.3 m.
class CarpetEdge final : public Recording {
 public:
  explicit CarpetEdge(double tilt) : tilt_(tilt), camera_(testing::small_test_camera(0.3)) {
    calibration_.depth_camera = camera_;
    calibration_.odometry.planar = true;
  }
  std::optional<Measurement> next() override {
    if (given_ == 2 * 81) return std::nullopt;
    const int k = given_++;
    const double t = 0.1 * (k / 2), x = std::max(0.0, t - 2);
    if (k % 2 == 0) return Odometry{at(t), SE3(SO3(), {x, 0, 0})};
    const SO3 R = x < 0.3 ? SO3::rot_y(-tilt_) : SO3();
    const Eigen::Vector3d up = R.inverse() * Eigen::Vector3d(0, 0, 1);
    DepthFrame frame = testing::draw({{Plane(up, 0)}}, camera_, 0.02, 1);
    frame.stamp = at(t);
    return frame;
  }
  std::optional<std::int64_t> depth_hint() const override { return 81; }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }
  WheelTrack wheels() const {
    WheelTrack wheels(calibration_.odometry);
    for (double t = 0; t < 8.05; t += 0.1)
      wheels.add({at(t), SE3(SO3(), {std::max(0.0, t - 2), 0, 0})});
    return wheels;
  }

 private:
  double tilt_;
  int given_ = 0;
  DepthCamera camera_;
  Calibration calibration_;
};

std::optional<TiltedStart> find(double tilt) {
  CarpetEdge recording(tilt);
  return find_tilted_start(recording, recording.wheels(), {}, {}, [] { return false; });
}

TEST(StartCalibration, FindsATiltedBodyAndNoneThatIsNot) {
  const auto found = find(3 * kDegree);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->usual.pitch / kDegree, 0, 0.1);
  EXPECT_NEAR(found->start.pitch / kDegree, -3, 0.2);
  EXPECT_FALSE(find(0));
}

TEST(StartCalibration, EndsWithTheUser) {
  CarpetEdge recording(3 * kDegree);
  EXPECT_FALSE(find_tilted_start(recording, recording.wheels(), {}, {}, [] { return true; }));
}

// The first pose is tilted, the map and the camera's mounting are not: not for as long as it
// stands.
TEST(StartCalibration, TiltsTheFirstPoseOnly) {
  CarpetEdge recording(3 * kDegree);
  FrontEnd front_end({}, recording.calibration());
  const auto start = find(3 * kDegree);
  ASSERT_TRUE(start);
  front_end.begin_tilted(*start);
  Diagnostics metrics;
  bool first = true;
  for (int images = 0; images < 19;) {
    const auto step = front_end.process(*recording.next(), metrics);
    if (!step) continue;
    ++images;
    const Observations& o = step->observations;
    const SE3& T_body_camera = recording.calibration().depth_camera->camera.T_body_camera;
    EXPECT_LT((T_body_camera.inverse() * o.T_body_sensor).so3().log().norm(), 0.2 * kDegree);
    ASSERT_TRUE(o.first_floor_map);
    EXPECT_GT(o.first_floor_map->normal().z(), std::cos(0.01 * kDegree));
    EXPECT_NEAR(o.first_floor_map->rho(), 0, 0.01);
    if (first) {
      const Eigen::Vector3d forward = step->motion.T_from_to.so3() * Eigen::Vector3d::UnitX();
      EXPECT_NEAR(std::asin(forward.z()) / kDegree, 3, 0.2);
    }
    first = false;
  }
}

}  // namespace
}  // namespace lamina
