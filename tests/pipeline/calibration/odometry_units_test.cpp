// Odometry that is not in metres and radians, beside images of a room.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/pipeline/calibration/odometry_units.hpp>
#include <lamina/sensors/corrected_recording.hpp>

#include "frontend/motion/plane_camera.hpp"

namespace lamina {
namespace {

constexpr int kImages = 11, kEach = 5;  // measurements of an image's time

// On a curve through a room.
SE3 pose(double i) { return SE3::exp(i * SE3::planar(0.16, 0, 0.12).log()); }
Timestamp stamp(double i) { return Timestamp::from_seconds(1000 + 0.3 * i); }

// Every other pixel of every other row: quicker.
DepthFrame coarse(const DepthFrame& fine) {
  DepthFrame f = fine;
  CameraModel& c = f.camera.camera;
  c.width /= 2;
  c.height /= 2;
  c.fx /= 2;
  c.fy /= 2;
  c.cx /= 2;
  c.cy /= 2;
  f.raw.clear();
  for (int v = 0; v < c.height; ++v)
    for (int u = 0; u < c.width; ++u)
      f.raw.push_back(fine.raw[static_cast<std::size_t>(4 * v * c.width + 2 * u)]);
  return f;
}

const std::vector<DepthFrame>& images() {
  static const std::vector<DepthFrame> all = [] {
    made_up::Camera camera;
    std::vector<DepthFrame> drawn;
    for (int i = 0; i < kImages; ++i) {
      const SE3 T = SE3::planar(-1, -0.5, 0) * pose(i);
      drawn.push_back(coarse(camera.see(made_up::room(), T, 0)));
      drawn.back().stamp = stamp(i);
    }
    return drawn;
  }();
  return all;
}

// Four times odometry, then an image; `way` and `turn`: what the odometry's numbers are of metres,
// radians.
class Drive final : public Recording {
 public:
  Drive(double way, double turn, int blank) : way_(way), turn_(turn), blank_(blank) {
    calibration_.depth_camera.emplace();
  }
  std::optional<Measurement> next() override {
    if (given_ == kEach * (blank_ + kImages)) return std::nullopt;
    const int i = given_ / kEach - blank_, part = given_++ % kEach;
    if (part == 1 && i < 0) {
      DepthFrame covered = images().front();
      covered.stamp = stamp(i);
      std::fill(covered.raw.begin(), covered.raw.end(), std::uint16_t{0});
      return covered;
    }
    if (part == 1) return images()[static_cast<std::size_t>(i)];
    const double at = i + std::max(0, part - 1) * 1.0 / (kEach - 1);
    const SE3 T = pose(at);
    const Eigen::Vector3d t = way_ * T.translation();
    return Odometry{stamp(at), SE3::planar(t.x(), t.y(), turn_ * T.so3().yaw())};
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }

 private:
  double way_, turn_;
  int blank_, given_ = 0;
  Calibration calibration_;
};

OdometryUnits found(double way, double turn, std::vector<Warning>& warnings,
                    const CalibrationOptions& settings = {}, int blank = 0) {
  const OpenInUnits open = [=](const OdometryUnits& units) {
    return std::make_unique<CorrectedRecording>(std::make_unique<Drive>(way, turn, blank),
                                                ScanCorrection(), 0.1, units);
  };
  return look_at_odometry_units(open, settings, warnings, [] { return false; });
}

TEST(OdometryUnits, MetresAndRadiansStay) {
  for (const double way : {1.0, 0.9, 1.1}) {
    std::vector<Warning> warnings;
    EXPECT_FALSE(found(way, 1, warnings).any()) << way;
    EXPECT_TRUE(warnings.empty()) << way;
  }
}

// Taken as metres they made a map of hundreds.
TEST(OdometryUnits, MillimetresAndFeetAreFoundAndCorrected) {
  for (const auto& [way, metres] : {std::pair{1000.0, 0.001}, {1 / 0.3048, 0.3048}}) {
    std::vector<Warning> warnings;
    EXPECT_EQ(found(way, 1, warnings).way, metres);
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].id, "wheel_scale");
  }
}

TEST(OdometryUnits, ImagesThatShowNothingAreNoEvidence) {
  std::vector<Warning> warnings;
  EXPECT_NEAR(found(1000, 1, warnings, {}, 45).way, 0.001, 1e-9);
}

TEST(OdometryUnits, DegreesAreFoundAndCorrected) {
  std::vector<Warning> warnings;
  const OdometryUnits units = found(1, 180 / M_PI, warnings);
  EXPECT_EQ(units.way, 1);
  EXPECT_NEAR(units.turn, M_PI / 180, 1e-12);
  EXPECT_EQ(warnings.size(), 1U);
}

TEST(OdometryUnits, AWayOfNoKnownUnitIsFound) {
  std::vector<Warning> warnings;
  EXPECT_NEAR(found(0.55, 1, warnings).way, 1 / 0.55, 0.05);
  CalibrationOptions off;
  off.calibrate_wheels = false;
  EXPECT_FALSE(found(0.55, 1, warnings, off).any());
  EXPECT_EQ(warnings.size(), 2U);
}

TEST(OdometryInMetres, HeadingsAreFollowedAcrossTheirEnds) {
  OdometryInMetres in_metres({0.001, M_PI / 180});
  Odometry last;
  for (int i = 0; i <= 40; ++i)  // 3 degrees a step, written as radians: nearly half a turn
    last = in_metres.of({stamp(i), SE3::planar(10.0 * i, 0, std::remainder(3.0 * i, 2 * M_PI))});
  EXPECT_NEAR(last.T_odom_body.so3().yaw(), 120 * M_PI / 180, 1e-9);
  EXPECT_NEAR(last.T_odom_body.translation().x(), 0.4, 1e-9);
}

}  // namespace
}  // namespace lamina
