// A first look over a recording for the bend of its depth images.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/models/skipped.hpp>
#include <lamina/pipeline/calibration/camera/depth_calibration.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

// Frames of a floor and a wall that comes nearer, bent by `bend` px at the sides of the image.
class BentRecording final : public Recording {
 public:
  BentRecording(int frames, double bend)
      : frames_(frames), bend_(bend), camera_(testing::small_test_camera(0.3)) {}
  std::optional<Measurement> next() override {
    if (given_ == frames_) return std::nullopt;
    if (breaks_at && given_ == *breaks_at) throw Error("the file ends here");
    const double t = given_++;
    const double heading = 0.4 * std::sin(t), far = 3 - 0.02 * t;
    const std::vector<testing::Piece> pieces{
        {Plane({0, 0, 1}, 0)}, {Plane({-std::cos(heading), -std::sin(heading), 0}, -far)}};
    DepthFrame frame = testing::draw(pieces, camera_, 0.02, static_cast<std::uint64_t>(given_));
    frame.stamp = Timestamp::from_seconds(0.1 * t);
    frame.camera.camera.T_body_camera = said * camera_.camera.T_body_camera;
    for (std::size_t i = 0; i < frame.raw.size(); ++i) {
      if (frame.raw[i] == 0) continue;
      const double x = static_cast<double>(i % 160) / 79.5 - 1;
      const double d = camera_.noise.disparity(frame.raw[i] / camera_.depth_scale) + bend_ * x * x;
      frame.raw[i] =
          static_cast<std::uint16_t>(camera_.noise.focal_baseline / d * camera_.depth_scale + 0.5);
    }
    return frame;
  }
  std::optional<std::int64_t> depth_hint() const override { return hint; }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }

  std::optional<int> breaks_at;
  std::optional<std::int64_t> hint;
  SE3 said;  ///< what the calibration has the camera moved by

 private:
  int frames_, given_ = 0;
  double bend_;
  DepthCamera camera_;
  Calibration calibration_;
};

TEST(DepthCalibration, TakesTheBendOut) {
  BentRecording recording(300, 0.3);
  Diagnostics metrics;
  const DepthDistortion found = calibrate_depth(recording, {}, metrics, [] { return false; }).bend;
  ASSERT_FALSE(found.empty());
  // Between the middle of a row and its ends, and half way: constants and slopes are not told.
  const auto at = [&](std::size_t u) { return static_cast<double>(found.field()[60 * 160 + u]); };
  EXPECT_NEAR(0.5 * (at(0) + at(159)) - at(80), 0.3, 0.05);
  EXPECT_NEAR(0.5 * (at(40) + at(119)) - at(80), 0.075, 0.03);
  EXPECT_NEAR(metrics.counts.depth_bend_rms_px, found.rms(), 1e-12);
}

TEST(DepthCalibration, LeavesStraightImagesAlone) {
  BentRecording recording(300, 0);
  Diagnostics metrics;
  EXPECT_TRUE(calibrate_depth(recording, {}, metrics, [] { return false; }).bend.empty());
  EXPECT_EQ(metrics.counts.depth_bend_rms_px.known(), false);
}

// Tilt alone is followed from the first image on; tilt and height together look like a ramp, image
// after image, and what is seen until that is disbelieved would lie askew in the map.
TEST(DepthCalibration, AMountingWrongInTiltAndHeightIsFound) {
  Diagnostics metrics;
  BentRecording right(45, 0), wrong(45, 0);
  right.hint = wrong.hint = 45;
  EXPECT_FALSE(calibrate_depth(right, {}, metrics, [] { return false; }).mounting);
  wrong.said = SE3(SO3::rot_y(0.04) * SO3::rot_x(0.03), {0, 0, 0.06});
  const auto found = calibrate_depth(wrong, {}, metrics, [] { return false; }).mounting;
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->roll, -0.03, 0.005);
  EXPECT_NEAR(found->pitch, -0.04, 0.005);
  EXPECT_NEAR(found->height, 0.8, 0.01);
  EXPECT_NEAR(metrics.counts.camera_start_height_m, found->height, 1e-12);
}

TEST(DepthCalibration, EndsWithTheUserOrTheFile) {
  Diagnostics metrics;
  BentRecording ended(300, 0.3);
  EXPECT_TRUE(calibrate_depth(ended, {}, metrics, [] { return true; }).bend.empty());
  BentRecording broken(300, 0.3);
  broken.breaks_at = 50;
  EXPECT_TRUE(calibrate_depth(broken, {}, metrics, [] { return false; }).bend.empty());
}

}  // namespace
}  // namespace lamina
