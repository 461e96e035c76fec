// The real recordings read as their sources say. Skipped where ../shared/data is absent.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/bag_contents.hpp>
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

// The same run as ROS 1 bag and as ROS 2 .db3.
TEST(RealRecordings, JackalIsTheSameByBothBags) {
  const std::string folder = data_folder() + "/ros2/jackal";
  OPEN_OR_SKIP(old_one, folder + "/run.bag");
  const auto new_one = open_recording(folder);
  for (int scans = 0;; ++scans) {
    const auto a = old_one->next(), b = new_one->next();
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) {
      EXPECT_EQ(scans, 414);
      break;
    }
    const auto &x = std::get<LaserScan>(*a), &y = std::get<LaserScan>(*b);
    ASSERT_EQ(x.stamp, y.stamp);
    ASSERT_EQ(x.angle_min, y.angle_min);
    ASSERT_EQ(x.angle_increment, y.angle_increment);
    ASSERT_EQ(x.size(), y.size());
    for (std::size_t i = 0; i < x.size(); ++i)
      ASSERT_TRUE(x.ranges[i] == y.ranges[i] ||
                  (std::isnan(x.ranges[i]) && std::isnan(y.ranges[i])));
  }
}

// Recordings with nothing to map are listed, and refused with one line that lists them, too.
TEST(RealRecordings, BagsWithoutSensorsAreListed) {
  const std::string folder = data_folder() + "/ros2/";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not here";
  const std::map<std::string, std::vector<std::string>> expected = {
      {"nav2_turtlebot.mcap",
       {"/odom (nav_msgs/Odometry, 2639)", "/tf (tf2_msgs/TFMessage, 5422)"}},
      {"compressed/file_compression",
       {"/topic (std_msgs/String, 383)", "/rosout (rcl_interfaces/Log, 392)"}},
      {"compressed/message_compression",
       {"/topic (std_msgs/String, 369)", "/rosout (rcl_interfaces/Log, 758)"}},
      {"compressed/wbag_0.mcap", {"AAA (std_msgs/String, 174)", "HHH (std_msgs/String, 148)"}}};
  for (const auto& [name, topics] : expected) {
    std::string message;
    try {
      open_recording(folder + name);
    } catch (const Error& error) {
      message = error.what();
    }
    EXPECT_EQ(message.find(folder + name + ": found no topic of scans, depth images or clouds"), 0u)
        << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
    for (const std::string& topic : topics)
      EXPECT_NE(message.find(topic), std::string::npos) << message;
    EXPECT_EQ(describe_bag(folder + name).find("damaged"), std::string::npos);
  }
  const std::string hole = describe_bag(folder + "nav2_turtlebot.mcap");
  EXPECT_NE(hole.find("1.76"), std::string::npos) << hole;
}

}  // namespace
}  // namespace lamina
