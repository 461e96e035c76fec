// The real recordings read as their sources say. Skipped where ../shared/data is absent.
#include <gtest/gtest.h>

#include <cstdlib>

#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/recording_info.hpp>

namespace lamina {
namespace {

std::string data_folder() {
  const char* folder = std::getenv("LAMINA_DATA");
  return folder ? folder : LAMINA_SOURCE_DIR "/../shared/data";
}

struct Counts {
  std::int64_t depth = 0, stereo = 0, scans = 0, odometry = 0;
  bool ordered = true;
};

Counts count(Recording& recording) {
  Counts counts;
  std::optional<Timestamp> last;
  while (const auto m = recording.next()) {
    counts.depth += std::holds_alternative<DepthFrame>(*m);
    counts.stereo += std::holds_alternative<StereoFrame>(*m);
    counts.scans += std::holds_alternative<LaserScan>(*m);
    counts.odometry += std::holds_alternative<Odometry>(*m);
    counts.ordered = counts.ordered && (!last || *last <= stamp_of(*m));
    last = stamp_of(*m);
  }
  return counts;
}

#define OPEN_OR_SKIP(recording, path)                                           \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << (path) << " is not here"; \
  const auto recording = open_recording(path)

TEST(RealRecordings, CorridorHas220DepthFrames) {
  OPEN_OR_SKIP(recording, data_folder() + "/icsl_corridor");
  const Counts counts = count(*recording);
  EXPECT_EQ(counts.depth, 220);
  EXPECT_TRUE(counts.ordered);
  EXPECT_TRUE(recording->skipped().empty());
}

TEST(RealRecordings, StructureHas252DepthFrames) {
  OPEN_OR_SKIP(recording, data_folder() + "/tum_fr3_structure_notexture_far");
  EXPECT_EQ(count(*recording).depth, 252);
}

TEST(RealRecordings, FreiburgHas4791ScansWithOdometry) {
  OPEN_OR_SKIP(recording, data_folder() + "/freiburg_079/freiburg-079.log");
  const Counts counts = count(*recording);
  EXPECT_EQ(counts.scans, 4791);
  EXPECT_EQ(counts.odometry, 4791);
  EXPECT_TRUE(counts.ordered);
}

TEST(RealRecordings, MinesHas756ScansWithOdometry) {
  OPEN_OR_SKIP(recording, data_folder() + "/mines_exp1/exp1.log");
  const Counts counts = count(*recording);
  EXPECT_EQ(counts.scans, 756);
  EXPECT_EQ(counts.odometry, 756);
  ASSERT_TRUE(recording->calibration().lidar.has_value());
  EXPECT_NEAR(recording->calibration().lidar->T_body_lidar.translation().x(), 0.145, 1e-6);
}

TEST(RealRecordings, PotholesHaveEightPairs) {
  OPEN_OR_SKIP(recording, data_folder() + "/stereo_potholes_1");
  int pairs = 0;
  while (const auto m = recording->next()) {
    const auto* pair = std::get_if<StereoFrame>(&*m);
    if (!pair) continue;
    ++pairs;
    const DepthFrame depth = depth_from_stereo(*pair);
    const auto holes = std::count(depth.raw.begin(), depth.raw.end(), std::uint16_t{0});
    const double density = 1 - static_cast<double>(holes) / static_cast<double>(depth.raw.size());
    EXPECT_GE(density, 0.75);
    RecordProperty("density_" + std::to_string(pairs), std::to_string(density));
  }
  EXPECT_EQ(pairs, 8);
}

TEST(RealRecordings, OpenNiFileGivesAllTwelveFrames) {
  OPEN_OR_SKIP(recording, data_folder() + "/openni_kinect/recording.oni");
  const RecordingInfo info = inspect(*recording);
  EXPECT_EQ(info.streams.at("depth").count, 12);
  EXPECT_TRUE(info.skipped.empty());
  EXPECT_NEAR(info.depth->median_m, 2.78, 0.02);
  EXPECT_NEAR(info.calibration.depth_camera->camera.fx, 575.8, 1.0);
}

TEST(RealRecordings, SenaLoopHas225ScansWithOdometry) {
  OPEN_OR_SKIP(recording,
               "/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
  // Known before anything is read: the preset follows it.
  ASSERT_TRUE(recording->calibration().lidar.has_value());
  EXPECT_GT((recording->calibration().lidar->T_body_lidar.so3() * Eigen::Vector3d::UnitZ()).z(),
            0.99);
  const Counts counts = count(*recording);
  EXPECT_EQ(counts.scans, 225);
  EXPECT_EQ(counts.odometry, 225);
  EXPECT_TRUE(counts.ordered);
}

TEST(RealRecordings, MrptRgbdFrameReads) {
  OPEN_OR_SKIP(recording, "/usr/share/mrpt/datasets/tests_rgbd.rawlog");
  const auto first = recording->next();
  ASSERT_TRUE(first.has_value());
  const auto* frame = std::get_if<DepthFrame>(&*first);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->width(), 640);
  EXPECT_EQ(frame->height(), 480);
}

}  // namespace
}  // namespace lamina
