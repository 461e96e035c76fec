// Scans and images that come again and again while the odometry moves.
#include <gtest/gtest.h>

#include <lamina/pipeline/stated_scanner.hpp>
#include <lamina/pipeline/unrepeated_recording.hpp>

#include "support/listed_recording.hpp"

namespace lamina {
namespace {

Timestamp at(int i) { return Timestamp::from_seconds(100 + 0.1 * i); }

LaserScan scan(int i, float first) {
  LaserScan s;
  s.stamp = at(i);
  s.angle_min = -1;
  s.angle_increment = 1;
  s.ranges = {first, 2, 3};
  return s;
}

DepthFrame image(int i, std::uint16_t first) {
  DepthFrame d;
  d.stamp = at(i);
  d.raw = {first, 1000, 2000};
  return d;
}

// Ten scans and images, from the fourth to the eighth the same, on a body that goes `step` metres
// from one to the next.
std::vector<Measurement> hung(double step) {
  std::vector<Measurement> all;
  for (int i = 0; i < 10; ++i) {
    const int content = i < 3 || i > 7 ? i : 3;
    all.push_back(Odometry{at(i), SE3::planar(step * i, 0, 0)});
    all.push_back(scan(i, 1 + 0.1F * static_cast<float>(content)));
    all.push_back(image(i, static_cast<std::uint16_t>(500 + content)));
  }
  return all;
}

struct Emptied {
  int scans = 0, images = 0;
  std::vector<Warning> warnings;
};

Emptied emptied(std::vector<Measurement> all) {
  UnrepeatedRecording recording(std::make_unique<testing::ListedRecording>(std::move(all)));
  Emptied counts;
  while (const auto m = recording.next()) {
    if (const auto* s = std::get_if<LaserScan>(&*m)) counts.scans += !s->valid(0) && !s->valid(1);
    if (const auto* d = std::get_if<DepthFrame>(&*m)) counts.images += d->raw[1] == 0;
  }
  counts.warnings = recording.warnings();
  return counts;
}

TEST(UnrepeatedRecording, EmptiesWhatRepeatsWhileTheOdometryMoves) {
  const Emptied counts = emptied(hung(0.05));
  EXPECT_EQ(counts.scans, 4);
  EXPECT_EQ(counts.images, 4);
  ASSERT_EQ(counts.warnings.size(), 2);
  EXPECT_EQ(counts.warnings[0].id, "scans_repeat");
  EXPECT_EQ(counts.warnings[1].id, "images_repeat");
  EXPECT_NE(counts.warnings[0].text.find("4 of 10 scans"), std::string::npos);
  EXPECT_NE(counts.warnings[0].text.find("0.20 m"), std::string::npos);
}

// Scans of both come in turn, so that none holds what the one before it held.
TEST(UnrepeatedRecording, OneOfTwoScannersThatHangsIsFound) {
  std::vector<Measurement> all;
  for (const Measurement& m : hung(0.05)) {
    all.push_back(m);
    if (const auto* s = std::get_if<LaserScan>(&m)) {
      LaserScan rear = *s;
      rear.lidar.T_body_lidar = SE3::planar(-0.3, 0, M_PI);
      rear.ranges[1] = 3 + 0.01F * static_cast<float>(all.size());
      all.push_back(rear);
    }
  }
  EXPECT_EQ(emptied(all).scans, 4);
}

TEST(UnrepeatedRecording, ARobotThatStandsSeesTheSame) {
  const Emptied counts = emptied(hung(0.0005));
  EXPECT_EQ(counts.scans + counts.images, 0);
  EXPECT_TRUE(counts.warnings.empty());
}

TEST(UnrepeatedRecording, WithoutOdometryNothingTells) {
  std::vector<Measurement> all;
  for (const Measurement& m : hung(0.05)) {
    if (!std::holds_alternative<Odometry>(m)) all.push_back(m);
  }
  EXPECT_EQ(emptied(all).scans, 0);
}

TEST(StatedScanner, GoesOverWhatTheRecordingSays) {
  StatedScannerRecording recording(
      std::make_unique<testing::ListedRecording>(std::vector<Measurement>{scan(0, 1)}),
      {0.03, 1.0});
  const auto m = recording.next();
  ASSERT_TRUE(m);
  const auto& s = std::get<LaserScan>(*m);
  EXPECT_EQ(s.lidar.noise.range_sigma, 0.03);
  EXPECT_DOUBLE_EQ(s.angle(0), -0.5);
  EXPECT_DOUBLE_EQ(s.angle(2), 0.5);
  LaserScan as_recorded = scan(0, 1);
  StatedScanner().apply(as_recorded);
  EXPECT_EQ(as_recorded.angle_min, -1);
}

}  // namespace
}  // namespace lamina
