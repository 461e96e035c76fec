// Slopes of a depth camera, found by steps of wheels and images.
#include <gtest/gtest.h>

#include <lamina/io/figure_names.hpp>
#include <lamina/models/skipped.hpp>
#include <lamina/pipeline/calibration/camera/depth_intrinsics.hpp>

#include "backend/mapper/mapper_room.hpp"
#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

const Eigen::Vector3d kNothing = Eigen::Vector3d::Zero();
const SE3 kOptical(SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), {0.1, 0, 0.5});

// A lap and a half of a room by a camera that errs by `error`.
std::vector<Step> steps_with(const DepthCameraError& error, const WheelErrors::Vector& wheels) {
  const made_up::Drive drive(180, 120, 61);
  const auto room = made_up::make_room();
  made_up::Sensor sensor(62);
  const DepthCameraError as_seen = error.inverse();
  const SE3 T_camera_body = kOptical.inverse();
  std::vector<Step> steps(drive.truth.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    Observations& o = steps[i].observations;
    o = sensor.depth(drive.truth[i], made_up::at_frame(3 * i), room);
    o.T_body_sensor = kOptical;
    for (PlaneObservation& plane : o.planes) {
      plane.plane_sensor = as_seen.corrected(T_camera_body * plane.plane_sensor);
      plane.moments_sensor = as_seen.corrected(plane.moments_sensor.transformed(T_camera_body));
      for (auto& corner : plane.outline_sensor) corner = as_seen.corrected(T_camera_body * corner);
    }
    steps[i].motion = {drive.truth[0], drive.covariance};
    if (i > 0) steps[i].motion.T_from_to = corrected(drive.increments[i - 1], -wheels);
  }
  return steps;
}

TEST(DepthSlopes, AreFoundBesideErrorsOfTheWheels) {
  const DepthCameraError error{{0.007, 0, 0}};
  const auto found = depth_errors_of(steps_with(error, WheelErrors::of(0.01, 0.01, 0)), {},
                                     kNothing, [] { return false; });
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->camera().e.x(), 0.007, 0.0015);
  EXPECT_NEAR(found->camera().e.y(), 0, 0.0015);
  EXPECT_NEAR(found->camera().e.z(), 0, 5e-4);  // 1/m
  EXPECT_NEAR(found->wheels()(1), 0.01, 0.006);
  EXPECT_LT(std::abs(found->wheels()(3)), 0.01);  // the camera is not turned for it
}

TEST(DepthSlopes, AFocalLengthIsFoundAndElseLeftAsStated) {
  const auto none = [] { return false; };
  const auto found = depth_errors_of(steps_with({kNothing, -0.02}, WheelErrors::of(0.01, 0.01, 0)),
                                     {}, kNothing, none);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->camera().focal, -0.02, 0.004);
  EXPECT_NEAR(found->wheels()(1), 0.01, 0.006);
  const auto as_stated =
      depth_errors_of(steps_with({}, WheelErrors::of(0.01, 0.01, 0)), {}, kNothing, none);
  ASSERT_TRUE(as_stated);
  EXPECT_NEAR(as_stated->camera().focal, 0, 1e-6);
}

// Those that data left out do not confirm stay as stated; of small ones usual after a bend, more is
// told than nothing.
TEST(DepthSlopes, SmallOnesAreFoundWhereTheyAreConfirmed) {
  const auto none = [] { return false; };
  const auto small = steps_with({{0.001, 0, 0}}, WheelErrors::Vector::Zero());
  const auto held = depth_errors_of(small, {}, kNothing, none);
  ASSERT_TRUE(held);
  EXPECT_NEAR(held->camera().e.norm(), 0, 1e-6);
  const auto larger = steps_with({{0.003, 0, 0}}, WheelErrors::Vector::Zero());
  const auto found = depth_errors_of(larger, {}, {0.001, 0.001, 0.0005}, none);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->camera().e.x(), 0.003, 0.001);
  EXPECT_NEAR(found->camera().e.y(), 0, 0.001);
}

TEST(DepthSlopes, EndWithTheUser) {
  const auto steps = steps_with({}, WheelErrors::Vector::Zero());
  EXPECT_FALSE(depth_errors_of(steps, {}, kNothing, [] { return true; }));
  EXPECT_FALSE(depth_errors_of({}, {}, kNothing, [] { return false; }));
}

// Images of a floor without any odometry.
class ImagesAlone final : public Recording {
 public:
  ImagesAlone() { calibration_.odometry.planar = true; }
  std::optional<Measurement> next() override {
    if (given == 100) return std::nullopt;
    DepthFrame frame = testing::draw({{Plane({0, 0, 1}, 0)}}, testing::small_test_camera(0.3), 0.02,
                                     static_cast<std::uint64_t>(given));
    frame.stamp = Timestamp::from_seconds(0.2 * given++);
    return frame;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }
  int given = 0;

 private:
  Calibration calibration_;
};

TEST(DepthSlopes, AreNotSoughtWithoutWheels) {
  ImagesAlone recording;
  Diagnostics metrics;
  EXPECT_FALSE(find_depth_slopes(recording, {}, {}, {}, metrics, [] { return false; }));
  EXPECT_LE(recording.given, 31);
  EXPECT_TRUE(io::by_name(metrics.counts).empty());
}

}  // namespace
}  // namespace lamina
