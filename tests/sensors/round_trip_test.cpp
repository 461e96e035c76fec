// One simulated recording as folder, .oni, .bag and .pcd reads back the same measurements.
#include <gtest/gtest.h>

#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/png_image.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/text.hpp>

#if LAMINA_TEST_OPENNI
#include "sensors/oni_writer.hpp"
#endif
#if LAMINA_TEST_ROSBAG
#include "sensors/bag_writer.hpp"
#endif
#include "sensors/openni_driver/simulated_depth.hpp"
#include "sensors/temporary_folder.hpp"

namespace lamina {
namespace {
using test::DepthMode;
using test::TemporaryFolder;

std::vector<std::uint16_t> simulated(const DepthMode& mode, int frame) {
  std::vector<std::uint16_t> pixels;
  for (int v = 0; v < mode.height; ++v) {
    for (int u = 0; u < mode.width; ++u) pixels.push_back(simulated_depth_mm(mode, u, v, frame));
  }
  return pixels;
}

// Depth frames, stamps (relative to `start`) and intrinsics are those of the formula.
void expect_simulated(const std::string& input, double start) {
  const DepthMode mode;
  const auto recording = open_recording(input);
  int frames = 0;
  while (const auto m = recording->next()) {
    const auto* frame = std::get_if<DepthFrame>(&*m);
    if (!frame) continue;
    ASSERT_LT(frames, mode.frames);
    EXPECT_EQ(frame->raw, simulated(mode, frames)) << "frame " << frames;
    EXPECT_NEAR(frame->stamp.seconds() - start, 1e-6 * static_cast<double>(mode.stamp_us(frames)),
                1e-9);
    EXPECT_NEAR(frame->camera.camera.fx, mode.focal(), 1e-3);
    EXPECT_NEAR(frame->camera.camera.fy, mode.focal(), 1e-3);
    EXPECT_NEAR(frame->camera.camera.cx, 0.5 * (mode.width - 1), 1e-9);
    EXPECT_EQ(frame->camera.depth_scale, 1000);
    ++frames;
  }
  EXPECT_EQ(frames, mode.frames);
  EXPECT_TRUE(recording->skipped().empty());
}

TEST(RoundTrip, Folder) {
  const DepthMode mode;
  const TemporaryFolder folder;
  folder.write("calibration.yaml",
               "depth_camera: {model: kinect, width: 64, height: 48, fx: 57.6, fy: 57.6, cx: 31.5, "
               "cy: 23.5, depth_scale: 1000, T_body_camera: {translation: [0,0,0], rotation_xyzw: "
               "[-0.5,0.5,-0.5,0.5]}}\n");
  std::string list;
  for (int i = 0; i < mode.frames; ++i) {
    const std::string name = "depth/" + std::to_string(i) + ".png";
    folder.write(name, encode_png_depth({mode.width, mode.height, simulated(mode, i)}));
    const auto ns = static_cast<std::int64_t>(mode.stamp_us(i)) * 1000;
    list += Timestamp::from_nanoseconds(ns).to_string() + " " + name + "\n";
  }
  folder.write("depth.txt", list);
  expect_simulated(folder.path().string(), 0);
}

TEST(RoundTrip, Clouds) {
  const DepthMode mode;
  const TemporaryFolder folder;
  for (int i = 0; i < mode.frames; ++i) {
    std::ofstream out(folder.path() / ("1." + std::to_string(i) + ".pcd"));
    out << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << mode.width
        << "\nHEIGHT " << mode.height << "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS "
        << mode.width * mode.height << "\nDATA ascii\n";
    for (const std::uint16_t mm : simulated(mode, i)) {
      if (mm == 0) out << "nan nan nan\n";
      if (mm > 0) out << "0 0 " << mm / 1000.0 << "\n";
    }
  }
  folder.write("1.9.pcd", "not a cloud");
  const auto recording = open_recording(folder.path().string());
  int clouds = 0;
  while (const auto m = recording->next()) {
    const auto& cloud = std::get<CloudFrame>(*m);
    EXPECT_EQ(cloud.stamp.to_string(), "1." + std::to_string(clouds) + "00000");
    ASSERT_EQ(cloud.width, mode.width);
    ASSERT_EQ(cloud.height, mode.height);
    const auto expected = simulated(mode, clouds);
    int wrong = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const float z = cloud.points_sensor[i].z();
      wrong += expected[i] == 0 ? !std::isnan(z) : std::lround(z * 1000) != expected[i];
    }
    EXPECT_EQ(wrong, 0);
    ++clouds;
  }
  EXPECT_EQ(clouds, mode.frames);
  EXPECT_EQ(recording->skipped(), (SkippedCounts{{"damaged cloud", 1}}));
}

#if LAMINA_TEST_ROSBAG
TEST(RoundTrip, Bag) {
  const TemporaryFolder folder;
  test::write_simulated_bag(folder.file("whole.bag"), false);
  expect_simulated(folder.file("whole.bag"), 1);
  test::write_simulated_bag(folder.file("floats.bag"), true);
  expect_simulated(folder.file("floats.bag"), 1);
}

// The body is what the transforms from odom move, whatever it is called.
TEST(RoundTrip, BagWhoseOdometryIsTransforms) {
  const TemporaryFolder folder;
  test::write_simulated_bag(folder.file("tf.bag"), false, true);
  const auto recording = open_recording(folder.file("tf.bag"));
  const std::vector<std::string> remarks = recording->remarks();
  EXPECT_EQ(std::count(remarks.begin(), remarks.end(), "body frame: chassis"), 1);
  ASSERT_TRUE(recording->calibration().lidar.has_value());
  EXPECT_NEAR(recording->calibration().lidar->T_body_lidar.translation().x(), 0.2, 1e-9);
  int odometry = 0;
  while (const auto m = recording->next()) odometry += std::holds_alternative<Odometry>(*m);
  EXPECT_EQ(odometry, DepthMode().frames);
}

TEST(RoundTrip, BagHasScansOdometryAndMountings) {
  const TemporaryFolder folder;
  test::write_simulated_bag(folder.file("whole.bag"), false);
  const auto recording = open_recording(folder.file("whole.bag"));
  // Known before anything is read: the preset follows it.
  ASSERT_TRUE(recording->calibration().lidar.has_value());
  EXPECT_LT(
      (recording->calibration().lidar->T_body_lidar.translation() - Eigen::Vector3d(0.2, 0, 0.3))
          .norm(),
      1e-9);
  int scans = 0;
  std::optional<Odometry> odometry;
  while (const auto m = recording->next()) {
    if (const auto* o = std::get_if<Odometry>(&*m)) odometry = *o;
    const auto* scan = std::get_if<LaserScan>(&*m);
    if (!scan) continue;
    ASSERT_TRUE(odometry.has_value());
    EXPECT_EQ(odometry->stamp, scan->stamp);
    EXPECT_NEAR(odometry->T_odom_body.translation().x(), 0.1 * scans, 1e-12);
    EXPECT_TRUE(scan->lidar.T_body_lidar.translation().isApprox(Eigen::Vector3d(0.2, 0, 0.3)));
    EXPECT_EQ(scan->ranges[3], static_cast<float>(scans));
    EXPECT_FLOAT_EQ(static_cast<float>(scan->time_increment), scans % 2 == 0 ? 0.005F : 0.0F);
    ++scans;
  }
  EXPECT_EQ(scans, DepthMode().frames);
}

TEST(RoundTrip, DamagedBags) {
  const TemporaryFolder folder;
  test::write_simulated_bag(folder.file("whole.bag"), false);
  const std::string bytes = read_file_bytes(folder.file("whole.bag"));
  folder.write("cut.bag", bytes.substr(0, bytes.size() / 2));
  try {
    open_recording(folder.file("cut.bag"));
    FAIL() << "a bag without an index was accepted";
  } catch (const Error& error) {
    const std::string start =
        folder.file("cut.bag") + ": found a bag that is cut short or damaged (";
    EXPECT_EQ(std::string(error.what()).substr(0, start.size()), start);
  }
  // Damage anywhere gives an error or fewer messages, never a crash.
  for (std::size_t at = 20; at < bytes.size(); at += bytes.size() / 97) {
    std::string damaged = bytes;
    for (std::size_t i = at; i < std::min(at + 4, bytes.size()); ++i) damaged[i] = '\xff';
    folder.write("damaged.bag", damaged);
    int frames = 0;
    try {
      const auto recording = open_recording(folder.file("damaged.bag"));
      while (const auto m = recording->next()) frames += std::holds_alternative<DepthFrame>(*m);
    } catch (const Error&) {
    }
    EXPECT_LE(frames, DepthMode().frames) << "byte " << at;
  }
}

TEST(RoundTrip, BagTopicsAreOverridden) {
  const TemporaryFolder folder;
  test::write_simulated_bag(folder.file("whole.bag"), false);
  RecordingOptions options;
  options.topics["scan"] = "/other";
  try {
    open_recording(folder.file("whole.bag"), options);
    FAIL() << "a topic that is not there was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              folder.file("whole.bag") +
                  ":topic /other: found no such topic for scan, expected one of /scan");
  }
}
#endif

#if LAMINA_TEST_OPENNI
TEST(RoundTrip, OniFile) {
  const TemporaryFolder folder;
  test::record_simulated_oni("simulated:64x48@30*5", folder.file("a.oni"), 5);
  expect_simulated(folder.file("a.oni"), 0);
}

TEST(RoundTrip, LiveDevice) {
  const auto recording = open_recording("openni:simulated:64x48@30*20");
  const auto first = recording->next();
  ASSERT_TRUE(first.has_value());
  const auto& frame = std::get<DepthFrame>(*first);
  EXPECT_EQ(frame.width(), 64);
  EXPECT_FALSE(recording->size_hint().has_value());
}
#endif

}  // namespace
}  // namespace lamina
