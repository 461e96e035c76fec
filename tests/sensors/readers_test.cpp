// Readers on small literal inputs.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/sensors/readers/carmen_log.hpp>
#include <lamina/sensors/readers/png_image.hpp>
#include <lamina/sensors/readers/reorder_buffer.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/recording_info.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/text.hpp>
#include <lamina/sensors/time_order.hpp>

#include "sensors/temporary_folder.hpp"

namespace lamina {
namespace {
using test::TemporaryFolder;

std::vector<Timestamp> stamps(std::initializer_list<double> seconds) {
  std::vector<Timestamp> result;
  for (const double s : seconds) result.push_back(Timestamp::from_seconds(s));
  return result;
}

std::vector<Measurement> read_all(const std::string& input) {
  const auto recording = open_recording(input);
  std::vector<Measurement> all;
  while (auto m = recording->next()) all.push_back(*std::move(m));
  return all;
}

TEST(TimeOrder, DropsTheFewest) {
  using Indices = std::vector<std::size_t>;
  EXPECT_EQ(longest_increasing(stamps({1, 2, 3, 1.5, 4})), (Indices{0, 1, 2, 4}));
  EXPECT_EQ(longest_increasing(stamps({1, 2, 99, 3, 4})), (Indices{0, 1, 3, 4}));
  EXPECT_EQ(longest_increasing(stamps({1, 2, 3, 2.5, 4})), (Indices{0, 1, 2, 4}));
  EXPECT_EQ(longest_increasing(stamps({1, 1, 1})), (Indices{0}));
  EXPECT_TRUE(longest_increasing({}).empty());
}

TEST(TimeOrder, AssociatesTheNearestOnce) {
  const auto a = stamps({1.0, 1.1, 1.2}), b = stamps({1.015, 1.19, 1.205});
  EXPECT_EQ(associate_by_time(a, b, 0.02), (std::vector<std::ptrdiff_t>{0, -1, 2}));
  const auto close = stamps({1.0, 1.01});
  EXPECT_EQ(associate_by_time(close, stamps({1.009}), 0.02), (std::vector<std::ptrdiff_t>{-1, 0}));
}

TEST(TimeOrder, BufferGivesOldestFirst) {
  ReorderBuffer buffer(0.5, 8);
  Accelerometer sample;
  for (const double t : {1.0, 1.2, 1.1, 2.0}) {
    sample.stamp = Timestamp::from_seconds(t);
    EXPECT_TRUE(buffer.push(sample));
  }
  EXPECT_EQ(stamp_of(*buffer.pop()).seconds(), 1.0);
  EXPECT_EQ(stamp_of(*buffer.pop()).to_string(), "1.100000");
  sample.stamp = Timestamp::from_seconds(1.0);
  EXPECT_FALSE(buffer.push(sample));  // behind what was given
  EXPECT_EQ(stamp_of(*buffer.pop()).to_string(), "1.200000");
  EXPECT_FALSE(buffer.pop().has_value());
  buffer.finish();
  EXPECT_EQ(stamp_of(*buffer.pop()).seconds(), 2.0);
}

TEST(Carmen, GuessesAngles) {
  constexpr double kDegree = M_PI / 180;
  for (const std::size_t n : {180u, 181u, 360u, 361u}) {
    const auto [first, step] = carmen_guess_angles(n);
    EXPECT_NEAR(first, -90 * kDegree, 1e-12);
    EXPECT_NEAR(step, (n < 200 ? 1.0 : 0.5) * kDegree, 1e-12);
  }
  EXPECT_NEAR(carmen_guess_angles(1081).second, 0.25 * kDegree, 1e-12);
}

TEST(Carmen, InterpolatesOdometryToScans) {
  const TemporaryFolder folder;
  folder.write("a.log",
               "ODOM 0 0 0 0 0 0 1.0 h 1.0\nODOM 1 0 0 0 0 0 2.0 h 2.0\n"
               "FLASER 3 1 2 3 9 9 9 9 9 9 1.25 h 1.25\nODOM 2 0 0 0 0 0 3.0 h 3.0\n"
               "FLASER 3 1 2 3 9 9 9 9 9 9 2.5 h 2.5\n");
  const auto all = read_all(folder.file("a.log"));
  ASSERT_EQ(all.size(), 4u);
  EXPECT_NEAR(std::get<Odometry>(all[0]).T_odom_body.translation().x(), 0.25, 1e-12);
  EXPECT_EQ(stamp_of(all[0]), stamp_of(all[1]));
  EXPECT_NEAR(std::get<Odometry>(all[2]).T_odom_body.translation().x(), 1.5, 1e-12);
  EXPECT_EQ(std::get<LaserScan>(all[3]).size(), 3u);
}

TEST(Carmen, LaserPosesServeWhereThereIsNoOdom) {
  const TemporaryFolder folder;
  folder.write("a.log",
               "ROBOTLASER1 0 -1.5 3 1.0 5.6 0.01 0 4 1 5.6 0 2 0 0.2 0 0 0 0 0 0 0 0 0 0 1 h 1\n"
               "ROBOTLASER1 0 -1.5 3 1.0 5.6 0.01 0 4 1 5.6 0 2 0 1.2 0 0 1 0 0 0 0 0 0 0 2 h 2\n");
  const auto all = read_all(folder.file("a.log"));
  ASSERT_EQ(all.size(), 4u);
  const auto& scan = std::get<LaserScan>(all[1]);
  EXPECT_NEAR(scan.lidar.T_body_lidar.translation().x(), 0.2, 1e-12);
  EXPECT_EQ(scan.angle_min, -1.5);
  EXPECT_TRUE(scan.valid(0));
  EXPECT_FALSE(scan.valid(1));  // the largest range means no return
  EXPECT_FALSE(scan.valid(2));
  EXPECT_NEAR(std::get<Odometry>(all[2]).T_odom_body.translation().x(), 1, 1e-12);
}

TEST(Carmen, ParamPlacesALaserWhoseLinesDoNot) {
  const TemporaryFolder folder;
  const std::string param = "PARAM robot_frontlaser_offset 0.3 1 h 1\n";
  folder.write("raw.log", param + "RAWLASER1 0 -1 2 1 80 0.01 0 3 1 2 3 0 1.0 h 1.0\n");
  folder.write("posed.log", param + "FLASER 3 1 2 3 4 5 6 4 5 6 1.0 h 1.0\n");
  const auto raw = open_recording(folder.file("raw.log"));
  EXPECT_NEAR(raw->calibration().lidar->T_body_lidar.translation().x(), 0.3, 1e-12);
  // Equal laser and robot poses: the body is the laser.
  const auto posed = open_recording(folder.file("posed.log"));
  EXPECT_NEAR(posed->calibration().lidar->T_body_lidar.translation().norm(), 0, 1e-12);
}

// A robot that drives by what is nearer than 10 m sees further than that.
TEST(Carmen, NoReadingIsLostToAStatedLimit) {
  const TemporaryFolder folder;
  folder.write("a.log",
               "PARAM robot_front_laser_max 10 1 h 1\nODOM 0 0 0 0 0 0 1.0 h 1.0\n"
               "FLASER 4 1 20 81.91 3 0 0 0 0 0 0 1.0 h 1.0\n");
  const auto all = read_all(folder.file("a.log"));
  ASSERT_EQ(all.size(), 2u);
  const auto& scan = std::get<LaserScan>(all[1]);
  EXPECT_EQ(scan.range_max, 10);
  EXPECT_EQ(scan.ranges[1], 20);
  EXPECT_TRUE(std::isinf(scan.ranges[2]));
}

TEST(Carmen, RearLaserLooksBack) {
  const TemporaryFolder folder;
  folder.write(
      "a.log",
      "RLASER 3 1 2 3 0 0 0 0 0 0 1.25 h 1.25\nRAWLASER1 0 -1 2 1 80 0.01 0 3 1 2 3 0 1.0 h 1.0\n");
  const auto all = read_all(folder.file("a.log"));
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(std::get<LaserScan>(all[0]).angle_min, -1);
  const auto& rear = std::get<LaserScan>(all[1]);
  EXPECT_NEAR((rear.lidar.T_body_lidar * Eigen::Vector3d(1, 0, 0)).x(), -1, 1e-12);
}

TEST(Carmen, TrustsTheLoggersClockWhenTheSendersRunBack) {
  const TemporaryFolder folder;
  folder.write("a.log",
               "ODOM 0 0 0 0 0 0 900.0 h 1.0\nODOM 1 0 0 0 0 0 100.0 h 2.0\n"
               "FLASER 3 1 2 3 0 0 0 0 0 0 50.0 h 1.5\n");
  const auto all = read_all(folder.file("a.log"));
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(stamp_of(all[1]).to_string(), "1.500000");
}

// Passed over means not even opened: the second image is no image.
TEST(Dataset, PassesOverDepthImages) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml",
               "depth_camera: {model: ideal, width: 2, height: 1, fx: 1, fy: 1, cx: 0.5, cy: 0, "
               "depth_scale: 5000, T_body_camera: {translation: [0,0,1], rotation_xyzw: "
               "[-0.5,0.5,-0.5,0.5]}}\n");
  folder.write("a.png", encode_png_depth({2, 1, {5000, 0}}));
  folder.write("b.png", "no image");
  folder.write("c.png", encode_png_depth({2, 1, {10000, 0}}));
  folder.write("depth.txt", "1 a.png\n2 b.png\n3 c.png\n");
  folder.write("scans.csv", "0.5,0,0.1,0,5,1,2\n2.5,0,0.1,0,5,1,2\n");
  const auto recording = open_recording(folder.path().string());
  EXPECT_EQ(recording->depth_hint(), 3);
  const auto first = recording->next_depth(0);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->depth_m(0, 0), 1.0);
  const auto last = recording->next_depth(1);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->depth_m(0, 0), 2.0);
  EXPECT_TRUE(recording->skipped().empty());
  EXPECT_FALSE(recording->next_depth(0));
  const auto again = open_recording(folder.path().string());
  for (const char* stamp : {"0.500000", "2.500000"}) {
    const auto scan = again->next_light();
    ASSERT_TRUE(scan);
    EXPECT_EQ(stamp_of(*scan).to_string(), stamp);
  }
  EXPECT_FALSE(again->next_light());
  EXPECT_TRUE(again->skipped().empty());
}

TEST(Dataset, MergesStreamsAndInterpolatesOdometry) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml",
               "depth_camera: {model: ideal, width: 2, height: 1, fx: 1, fy: 1, cx: 0.5, cy: 0, "
               "depth_scale: 5000, T_body_camera: {translation: [0,0,1], rotation_xyzw: "
               "[-0.5,0.5,-0.5,0.5]}}\nodometry: {planar: false}\n");
  folder.write("d.png", encode_png_depth({2, 1, {5000, 0}}));
  folder.write("depth.txt", "1.5 d.png\n2.0 d.png\n");
  folder.write("odometry.txt", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n");
  folder.write("accelerometer.txt", "1.2 0 0 9.81\n");
  folder.write("scans.csv", "1.75,0,0.1,0,5,1,2\n");
  const auto all = read_all(folder.path().string());
  std::vector<std::size_t> kinds;
  for (const auto& m : all) kinds.push_back(m.index());
  // odometry, accelerometer, odometry + depth, odometry + scan, odometry + depth
  EXPECT_EQ(kinds, (std::vector<std::size_t>{3, 5, 3, 0, 3, 2, 3, 0}));
  EXPECT_TRUE(std::get<Odometry>(all[2]).interpolated);
  EXPECT_NEAR(std::get<Odometry>(all[2]).T_odom_body.translation().x(), 0.5, 1e-12);
  const auto& frame = std::get<DepthFrame>(all[3]);
  EXPECT_EQ(frame.depth_m(0, 0), 1.0);
  EXPECT_EQ(frame.disparity(1, 0), 0.0);
  // The camera looks along body x from 1 m up.
  const Eigen::Vector3d p = frame.camera.camera.T_body_camera * frame.point_camera(0, 0);
  EXPECT_TRUE(p.isApprox(Eigen::Vector3d(1, 0.5, 1), 1e-12)) << p.transpose();
}

TEST(Dataset, StreamsThatNothingIsMappedWithAreReadPast) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml",
               "lidar: {range_sigma: 0.01}\nimu: {gyro_noise: 1e-3}\ntags: {size: 0.16}\n"
               "gnss: {T_body_antenna: {translation: [0, 0, 1]}}\n");
  folder.write("scans.csv", "1,0,0.1,0,5,1,2\n2,0,0.1,0,5,1,2\n");
  folder.write("imu.txt", "1 0 0 0 0 0 9.81\n");
  folder.write("priors.txt", "pose 1 0 0 0 0 0 0 1 0.1 0.1\n");
  const auto recording = open_recording(folder.path().string());
  EXPECT_EQ(recording->skipped(), (SkippedCounts{{"stream not used", 2}}));
  EXPECT_EQ(recording->first_skipped().at("stream not used"), "imu.txt");
}

TEST(Dataset, InfoCountsWhatIsThere) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  folder.write("scans.csv",
               "1,0,0.1,0,5,1,2\n2,0,0.1,0,5,0,inf\n3,0,0.1,0,5,1,3\n9,0,0.1,0,5,1\n"
               "10,0,0.1,0,5,9,3\n");
  const auto recording = open_recording(folder.path().string());
  const RecordingInfo info = inspect(*recording);
  EXPECT_EQ(info.streams.at("scan").count, 4);
  EXPECT_EQ(info.streams.at("scan").gaps, 1);
  EXPECT_EQ(info.streams.at("scan").longest_gap_s, 7);
  EXPECT_EQ(info.scan->invalid, 3);
  EXPECT_EQ(info.scan->largest_m, 3);
  const std::string text = to_text(info);
  EXPECT_NE(text.find("skipped   1 x cut scan line, first scans.csv:4: found 1 ranges"),
            std::string::npos)
      << text;
  EXPECT_NE(
      text.find("  scan                 4      1.00      0.000      9.000           7.000       "
                "2.000     1\n"),
      std::string::npos)
      << text;
}

// Wheels whose recorder died early, and colour images that nothing else tells of.
TEST(Dataset, InfoTellsWhenEachStreamBeginsAndEnds) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  std::string scans, wheels;
  for (int i = 0; i <= 20; ++i) scans.append(std::to_string(100 + i)).append(",0,0.1,0,5,1,2\n");
  for (const double t : {100.25, 100.5, 100.75, 101.0, 108.0}) {  // stands still in between
    wheels.append(std::to_string(t)).append(" 0 0 0 0 0 0 1\n");
  }
  folder.write("scans.csv", scans);
  folder.write("odometry.txt", wheels);
  const auto recording = open_recording(folder.path().string());
  const RecordingInfo info = inspect(*recording);
  const StreamInfo& odometry = info.streams.at("odometry");
  EXPECT_EQ(odometry.count, 5);  // not those interpolated to scans
  EXPECT_EQ(odometry.rate_hz(), 4);
  EXPECT_EQ(odometry.last, Timestamp::from_seconds(108));
  EXPECT_EQ(odometry.longest_gap_s, 7);
  EXPECT_EQ(odometry.gap_begin, Timestamp::from_seconds(101));
  EXPECT_EQ(partial_streams(info),
            (std::vector<std::string>{"odometry ends 12.0 s before the recording does"}));
  EXPECT_NE(to_text(info).find("remark    odometry ends 12.0 s before"), std::string::npos);
}

// A file that is there states that its sensor was aboard.
TEST(Dataset, AFileWithoutALineIsSaidByInfoToo) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  folder.write("scans.csv", "1,0,0.1,0,5,1,2\n2,0,0.1,0,5,1,3\n");
  folder.write("odometry.txt", "# timestamp tx ty tz qx qy qz qw\n");
  const auto recording = open_recording(folder.path().string());
  const std::string text = to_text(inspect(*recording));
  EXPECT_NE(text.find("warning   odometry.txt holds no usable line"), std::string::npos) << text;
  EXPECT_EQ(text.find("scans.csv holds"), std::string::npos) << text;
}

TEST(Rectify, UndoesDistortion) {
  CameraModel camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 60;
  camera.cx = 31.5;
  camera.cy = 23.5;
  camera.distortion = {0.1, -0.05, 0.001, 0.002, 0.01};
  const Eigen::Vector2d centre = distort_pixel(camera, camera.cx, camera.cy);
  EXPECT_TRUE(centre.isApprox(Eigen::Vector2d(camera.cx, camera.cy), 1e-12));
  std::vector<std::uint16_t> raw(64 * 48);
  for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = static_cast<std::uint16_t>(i);
  const auto rectified = Rectifier(camera).depth(raw);
  const Eigen::Vector2d from = distort_pixel(camera, 50, 40);
  const auto expected = std::lround(from.y()) * 64 + std::lround(from.x());
  EXPECT_EQ(rectified[40 * 64 + 50], static_cast<std::uint16_t>(expected));
  camera.distortion.reset();
  EXPECT_FALSE(Rectifier(camera).needed());
}

TEST(Png, RoundTrip) {
  DepthImage image{5, 4, {}};
  for (int i = 0; i < 20; ++i) image.pixels.push_back(static_cast<std::uint16_t>(3277 * i));
  std::string why;
  const auto back = decode_png_depth(encode_png_depth(image), 5, 4, why);
  ASSERT_TRUE(back.has_value()) << why;
  EXPECT_EQ(back->pixels, image.pixels);
}

TEST(Text, Numbers) {
  EXPECT_EQ(parse_number("1.5"), 1.5);
  EXPECT_EQ(parse_number("+2"), 2.0);
  EXPECT_EQ(parse_number("1e-999"), 0.0);
  EXPECT_FALSE(parse_number("1e999").has_value());
  EXPECT_FALSE(parse_number("nan").has_value());
  EXPECT_FALSE(parse_number("1x").has_value());
  EXPECT_FALSE(parse_number("").has_value());
  EXPECT_TRUE(std::isnan(*parse_number_or_special("NaN")));
  EXPECT_TRUE(std::isinf(*parse_number_or_special("inf")));
}

TEST(Stereo, FindsTheDepthOfAShiftedPattern) {
  StereoFrame pair;
  CameraModel& camera = pair.camera.camera;
  camera.width = 160;
  camera.height = 60;
  camera.fx = camera.fy = 100;
  camera.cx = 79.5;
  camera.cy = 29.5;
  pair.camera.baseline = 0.1;
  constexpr int kShift = 8;  // px: 100 x 0.1 / 8 = 1.25 m
  std::uint32_t state = 1;
  std::vector<std::uint8_t> wide(60 * 200);
  for (auto& pixel : wide) {
    state = state * 1664525u + 1013904223u;
    pixel = static_cast<std::uint8_t>(state >> 24);
  }
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 160; ++u) {
      pair.left.push_back(wide[static_cast<std::size_t>(v * 200 + u)]);
      pair.right.push_back(wide[static_cast<std::size_t>(v * 200 + u + kShift)]);
    }
  }
  const DepthFrame frame = depth_from_stereo(pair);
  EXPECT_NEAR(frame.depth_m(80, 30), 1.25, 0.01);
  EXPECT_NEAR(frame.depth_m(20, 30), 1.25, 0.01);  // within the searched range from the left edge
  const auto holes = std::count(frame.raw.begin(), frame.raw.end(), std::uint16_t{0});
  EXPECT_LT(static_cast<double>(holes), 0.15 * static_cast<double>(frame.raw.size()));
  EXPECT_NEAR(frame.camera.noise.focal_baseline, 10, 1e-12);
}

}  // namespace
}  // namespace lamina
