// What no camera can be, and what can be mended.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <lamina/sensors/camera_corrected_recording.hpp>
#include <lamina/sensors/depth_codes.hpp>
#include <lamina/sensors/intrinsics.hpp>

namespace lamina {
namespace {

CameraModel camera(double fx = 525, double fy = 525, double cx = 319.5, double cy = 239.5) {
  CameraModel c;
  c.width = 640;
  c.height = 480;
  c.fx = fx;
  c.fy = fy;
  c.cx = cx;
  c.cy = cy;
  return c;
}

TEST(Intrinsics, UsualCamerasPass) {
  for (const double fx : {120.0, 525.0, 2000.0}) {
    EXPECT_EQ(senseless_intrinsics(camera(fx, fx)), "") << fx;
  }
  EXPECT_EQ(senseless_intrinsics(camera(525, 525, 300, 260)), "");
}

TEST(Intrinsics, ZeroIdentityNanAndDenormalAreNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CameraModel& c :
       {camera(0, 0, 0, 0), camera(1, 1, 0, 0), camera(nan), camera(525, nan),
        camera(525, 525, nan), camera(525, 525, 319.5, nan), camera(6.9e-310), camera(525, 2000),
        camera(1e6, 1e6)}) {
    EXPECT_NE(senseless_intrinsics(c), "");
  }
  EXPECT_EQ(senseless_intrinsics(camera(525, 525, nan)),
            "fx 525, fy 525, cx nan, cy 239.5 for 640 x 480 pixels");
}

TEST(Intrinsics, OfImagesOfAnotherSizeAreScaled) {
  CameraModel c = camera(1050, 1050, 639.5, 479.5);
  ASSERT_TRUE(scale_intrinsics(c, 1280, 960));
  EXPECT_DOUBLE_EQ(c.fx, 525);
  EXPECT_DOUBLE_EQ(c.cx, 319.5);
  EXPECT_DOUBLE_EQ(c.cy, 239.5);
  EXPECT_FALSE(scale_intrinsics(c, 1280, 720));
}

TEST(Intrinsics, APrincipalPointThatWasNeverSetIsTheMiddle) {
  CameraModel c = camera(525, 525, 0, 239.5);
  const auto mended = mend_principal_point(c, "calibration.yaml");
  ASSERT_TRUE(mended);
  EXPECT_EQ(mended->id, "principal_point");
  EXPECT_NE(mended->text.find("calibration.yaml: found fx 525, fy 525, cx 0"), std::string::npos);
  EXPECT_DOUBLE_EQ(c.cx, 319.5);
  EXPECT_FALSE(mend_principal_point(c, "calibration.yaml"));
}

TEST(Intrinsics, ThoseOfTheFullImageAreHalved) {
  CameraModel c = camera(1050, 1050, 639.5, 479.5);
  const auto mended = mend_principal_point(c, "calibration.yaml");
  ASSERT_TRUE(mended);
  EXPECT_EQ(mended->id, "image_size");
  EXPECT_DOUBLE_EQ(c.fx, 525);
  EXPECT_DOUBLE_EQ(c.cx, 319.5);
}

// A slanted floor, further or nearer from image to image; `code` where nothing was measured.
std::vector<std::uint16_t> image(int k, std::uint16_t code, int clip = 60000) {
  std::vector<std::uint16_t> raw;
  for (int i = 0; i < 4800; ++i) {
    const int depth = 1000 + 40 * k + i % 4000;
    raw.push_back(i % 10 == 0 ? code : static_cast<std::uint16_t>(std::min(depth, clip)));
  }
  return raw;
}

TEST(DepthCodes, OneFarValueThatStandsAloneIsACode) {
  DepthCodes codes;
  for (int k = 0; k < 12; ++k) codes.add(image(k, 9990));
  const auto code = codes.code();
  ASSERT_TRUE(code);
  EXPECT_LE(code->least, 9990);
  EXPECT_GE(code->most, 9990);
  EXPECT_NEAR(code->share, 0.1, 0.01);
}

TEST(DepthCodes, DepthsAloneHoldNone) {
  DepthCodes codes, clipped;
  for (int k = 0; k < 12; ++k) {
    codes.add(image(k, 0));
    clipped.add(image(k, 0, 4000));  // of a sensor that clips: what is near is seen, too
  }
  EXPECT_FALSE(codes.code());
  EXPECT_FALSE(codes.common_largest());
  EXPECT_NEAR(codes.median(), 2820, 50);
}

// A robot that stands before a wall.
TEST(DepthCodes, AWallMetHeadOnIsNone) {
  DepthCodes codes;
  for (int k = 0; k < 12; ++k) codes.add(std::vector<std::uint16_t>(4800, 2500));
  EXPECT_FALSE(codes.code());
}

TEST(DepthCodes, ImagesStretchedToTheWholeRangeAreToldApart) {
  DepthCodes codes;
  for (int k = 0; k < 12; ++k) {
    std::vector<std::uint16_t> raw;
    for (int i = 0; i < 4800; ++i) {
      const double share = (i + 1) / 4800.0;
      raw.push_back(static_cast<std::uint16_t>(1 + 65533 * std::pow(share, 1 + 0.1 * k)));
    }
    codes.add(raw);
  }
  EXPECT_TRUE(codes.common_largest());
}

TEST(CameraFixes, AReachBoundsTheNoiseModel) {
  DepthFrame frame;
  frame.camera.noise.max_range = 8;
  CameraFixes fixes;
  for (const double reach : {20.0, 2.0}) {
    fixes.depth_reach = reach;
    EXPECT_TRUE(fixes.any());
    apply(fixes, frame);
    EXPECT_EQ(frame.camera.noise.max_range, std::min(8.0, reach));
  }
}

TEST(SaturatedDepths, AreTakenOutAndNamed) {
  SaturatedDepths saturated;
  std::vector<std::uint16_t> raw(1000, 900);
  raw[7] = raw[8] = 65535;
  saturated.drop(raw);
  EXPECT_EQ(raw[7], 0);
  EXPECT_EQ(raw[9], 900);
  ASSERT_TRUE(saturated.warning());
  EXPECT_EQ(saturated.warning()->id, "no_return_code");
  EXPECT_NE(saturated.warning()->text.find("65535"), std::string::npos);
}

// Pairs whose images name their own number: left 10 + k, right 20 + k.
class Pairs final : public Recording {
 public:
  std::optional<Measurement> next() override {
    if (k_ == 4) return std::nullopt;
    StereoFrame frame;
    frame.stamp = Timestamp::from_seconds(k_);
    frame.left = {static_cast<std::uint8_t>(10 + k_)};
    frame.right = {static_cast<std::uint8_t>(20 + k_)};
    ++k_;
    return frame;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }

 private:
  Calibration calibration_;
  int k_ = 0;
};

TEST(CameraFixes, OffsetsRaysAndTheRobotItselfAreTakenOutOfDepths) {
  DepthFrame frame;
  frame.camera.camera.width = 3;
  frame.camera.camera.height = 1;
  frame.camera.camera.fx = frame.camera.camera.fy = 1;
  frame.camera.camera.cx = 1;
  frame.camera.depth_scale = 1000;
  frame.raw = {2000, 2000, 65535};
  CameraFixes fixes;
  fixes.depth.offset = 0.1;
  EXPECT_TRUE(fixes.any());
  DepthFrame corrected = frame;
  apply(fixes, corrected);
  EXPECT_EQ(corrected.raw, (std::vector<std::uint16_t>{2500, 2500, 65535}));  // 1 / (0.5 - 0.1)
  fixes.depth.offset = 0.6;  // further than anything
  corrected = frame;
  apply(fixes, corrected);
  EXPECT_EQ(corrected.raw, (std::vector<std::uint16_t>{0, 0, 65535}));
  fixes.depth = {};
  fixes.depth.along_ray = true;
  fixes.robot = {false, true, false};
  corrected = frame;
  apply(fixes, corrected);
  EXPECT_EQ(corrected.raw, (std::vector<std::uint16_t>{1414, 0, 65535}));
}

TEST(CameraFixes, AnOffsetOfAPairMovesItsRightImage) {
  StereoFrame pair;
  pair.camera.camera.width = 5;
  pair.camera.camera.height = 1;
  pair.camera.camera.fx = pair.camera.camera.fy = 100;
  pair.camera.baseline = 0.1;
  pair.left = pair.right = {0, 0, 100, 0, 0};
  CameraFixes fixes;
  fixes.stereo.offset = 0.15;  // 1.5 px
  apply(fixes, pair);
  EXPECT_EQ(pair.right, (std::vector<std::uint8_t>{0, 0, 0, 50, 50}));
  EXPECT_EQ(pair.left, (std::vector<std::uint8_t>{0, 0, 100, 0, 0}));
}

TEST(CameraCorrectedRecording, LateRightImagesGoToTheirPairs) {
  for (const int late : {1, -1}) {
    CameraFixes fixes;
    fixes.right_late = late;
    CameraCorrectedRecording recording(std::make_unique<Pairs>(), fixes);
    int pairs = 0;
    while (const auto m = recording.next()) {
      const auto& pair = std::get<StereoFrame>(*m);
      EXPECT_EQ(pair.stamp.to_string(), Timestamp::from_seconds(pairs).to_string());
      EXPECT_EQ(pair.left[0], 10 + pairs + (late < 0));
      EXPECT_EQ(pair.right[0], 20 + pairs + (late > 0));
      ++pairs;
    }
    EXPECT_EQ(pairs, 3);
  }
}

TEST(CameraFixes, AreAppliedToDepthImages) {
  DepthFrame frame;
  frame.camera.camera = camera();
  frame.camera.camera.width = 2;
  frame.camera.camera.height = 1;
  frame.camera.depth_scale = 1000;
  frame.camera.noise = DepthNoise::kinect(525);
  frame.raw = {1000, 9990};
  CameraFixes fixes;
  fixes.depth.focal = 0.5;
  fixes.depth.depth = 0.2;
  fixes.depth.mirrored = true;
  fixes.depth_code = {9980, 10000};
  apply(fixes, frame);
  EXPECT_EQ(frame.raw, (std::vector<std::uint16_t>{0, 1000}));
  EXPECT_DOUBLE_EQ(frame.depth_m(1, 0), 0.2);
  EXPECT_DOUBLE_EQ(frame.camera.camera.fx, 262.5);
  EXPECT_NEAR(frame.camera.noise.sigma_depth(3), DepthNoise::kinect(262.5).sigma_depth(3), 1e-12);
}

}  // namespace
}  // namespace lamina
