// One malformed input a rule: each gives its exact message, or is skipped and counted.
#include <gtest/gtest.h>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/pcd_header.hpp>
#include <lamina/sensors/readers/png_image.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/text.hpp>

#include "sensors/temporary_folder.hpp"

namespace lamina {
namespace {
using test::TemporaryFolder;

constexpr const char* kCalibration =
    "depth_camera:\n"
    "  model: kinect\n"
    "  width: 4\n"
    "  height: 3\n"
    "  fx: 5.0\n"
    "  fy: 5.0\n"
    "  cx: 1.5\n"
    "  cy: 1.0\n"
    "  depth_scale: 1000\n"
    "  T_body_camera: {translation: [0, 0, 0], rotation_xyzw: [-0.5, 0.5, -0.5, 0.5]}\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  LAMINA_CHECK(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

// The message of what the callable throws; empty when it throws nothing.
template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string calibration_message(const std::string& text) {
  return message_of([&] { parse_calibration(text, "c.yaml"); });
}

std::string png(std::uint16_t value = 1000) {
  return encode_png_depth({4, 3, std::vector<std::uint16_t>(12, value)});
}

struct Result {
  std::vector<std::string> stamps;  // of depth frames and scans
  SkippedCounts skipped;
};
Result read_all(const std::string& input) {
  const auto recording = open_recording(input);
  Result result;
  while (const auto m = recording->next()) {
    if (!std::holds_alternative<Odometry>(*m)) result.stamps.push_back(stamp_of(*m).to_string());
  }
  result.skipped = recording->skipped();
  return result;
}
using Skips = SkippedCounts;

TEST(Malformed, CalibrationMessages) {
  const std::string good = kCalibration;
  EXPECT_EQ(calibration_message(good), "");
  EXPECT_EQ(calibration_message(replaced(good, "fx: 5.0", "fx: -5.0")),
            "c.yaml:5: depth_camera.fx: found '-5.0', expected a focal length above 0 (px)");
  EXPECT_EQ(calibration_message(replaced(good, "fx: 5.0", "fx: nan")),
            "c.yaml:5: depth_camera.fx: found 'nan', expected a focal length above 0 (px)");
  EXPECT_EQ(calibration_message(replaced(good, "fx: 5.0", "fx: five")),
            "c.yaml:5: depth_camera.fx: found 'five', expected a focal length above 0 (px)");
  EXPECT_EQ(calibration_message(replaced(good, "  fx: 5.0\n", "")),
            "c.yaml:2: depth_camera.fx: found nothing, expected a focal length above 0 (px)");
  EXPECT_EQ(calibration_message(replaced(good, "depth_scale", "depth_scal")),
            "c.yaml:9: depth_camera: found unknown key 'depth_scal', expected a known one: did "
            "you mean 'depth_scale'?");
  EXPECT_EQ(calibration_message(replaced(good, "fy: 5.0", "fx: 5.0")),
            "c.yaml:6: depth_camera: found key 'fx' a second time, expected each key once");
  EXPECT_EQ(calibration_message(replaced(good, "width: 4", "width: 4000000000")),
            "c.yaml:3: depth_camera.width: found '4000000000', expected a whole number from 1 to "
            "16384");
  EXPECT_EQ(calibration_message(replaced(good, "width: 4", "width: 4.5")),
            "c.yaml:3: depth_camera.width: found '4.5', expected a whole number from 1 to 16384");
  EXPECT_EQ(calibration_message(replaced(good, "model: kinect", "model: kinetc")),
            "c.yaml:2: depth_camera.model: found 'kinetc', expected kinect, stereo or ideal");
  EXPECT_EQ(calibration_message(replaced(good, "model: kinect", "model: stereo")),
            "c.yaml:2: depth_camera.baseline: found nothing, expected a baseline above 0 (m)");
  EXPECT_EQ(calibration_message(replaced(good, "[0, 0, 0]", "[0, 0]")),
            "c.yaml:10: depth_camera.T_body_camera.translation: found a list of 2, expected a list "
            "of 3 numbers");
  EXPECT_EQ(calibration_message(replaced(good, "-0.5, 0.5, -0.5, 0.5", "0, 0, 0, 0")),
            "c.yaml:10: depth_camera.T_body_camera.rotation_xyzw: found a quaternion of length 0, "
            "expected a unit quaternion x y z w");
  EXPECT_EQ(calibration_message(""), "c.yaml: found an empty file, expected `key: value` lines");
  EXPECT_EQ(calibration_message("just words"),
            "c.yaml:1: found 'just words', expected `key: value` lines");
  EXPECT_EQ(calibration_message("lidar: {range_sigma: 0}"),
            "c.yaml:1: lidar.range_sigma: found '0', expected a sigma above 0");
  EXPECT_EQ(calibration_message("a: [1"),
            "c.yaml:1: found bad YAML (end of sequence flow not found), expected `key: value` "
            "lines");
  EXPECT_EQ(calibration_message(std::string(100, '[')),
            "c.yaml:1: found nesting beyond all use, expected a calibration");
}

TEST(Malformed, InputsThatAreNoRecordings) {
  const TemporaryFolder folder;
  folder.write("empty.log", "");
  folder.write("notes.txt", "hello");
  folder.write("words.log", "hello\nworld\n");
  std::filesystem::create_directories(folder.path() / "folder.bag");
  const std::string kinds =
      "a dataset folder, .oni, .log, .clf, .rawlog, .bag, .db3, .mcap, a ROS 2 folder, .pcd, "
      "openni:URI, or ros2:[DOMAIN]";
  const auto open = [&](const std::string& name) {
    return message_of([&] { open_recording(folder.file(name)); });
  };
  EXPECT_EQ(open("absent.log"),
            folder.file("absent.log") + ": found no such file or folder, expected " + kinds);
  EXPECT_EQ(open("empty.log"),
            folder.file("empty.log") + ": found an empty file, expected a recording");
  EXPECT_EQ(open("notes.txt"), folder.file("notes.txt") + ": found a .txt file, expected " + kinds);
  EXPECT_EQ(open("folder.bag"),
            folder.file("folder.bag") + ": found a folder, expected a .bag file");
  EXPECT_EQ(open("words.log"),
            folder.file("words.log") +
                ": found no laser scan and no odometry (2 x line of no kind), expected CARMEN "
                "lines (ODOM, FLASER, ROBOTLASER1, ...)");
  EXPECT_EQ(message_of([&] { open_recording(folder.path().string()); }),
            folder.file("calibration.yaml") + ": found no such file, expected a readable file");
}

TEST(Malformed, FolderWhereAFileShouldBe) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", kCalibration);
  std::filesystem::create_directories(folder.path() / "depth.txt");
  EXPECT_EQ(message_of([&] { open_recording(folder.path().string()); }),
            folder.file("depth.txt") + ": found a folder, expected a file");
}

TEST(Malformed, DepthImagesAreSkippedAndCounted) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", kCalibration);
  folder.write("good.png", png());
  folder.write("cut.png", png().substr(0, 60));
  folder.write("text.png", "no picture");
  folder.write("empty.png", "");
  folder.write("large.png", encode_png_depth({5, 3, std::vector<std::uint16_t>(15, 1)}));
  std::string huge = png();  // a header that claims 2^30 columns; its checksum is wrong, too
  huge[16] = 0x40;
  folder.write("huge.png", huge);
  folder.write("depth.txt",
               "# comment\n1.0 good.png\n2.0 cut.png\n3.0 text.png\n4.0 empty.png\n"
               "5.0 large.png\n6.0 huge.png\n7.0 absent.png\n8.0\nnine good.png\n10.0 good.png\n"
               "9.5 good.png\n11.0 good.png\n");
  const Result result = read_all(folder.path().string());
  EXPECT_EQ(result.stamps,
            (std::vector<std::string>{"1.000000", "10.000000", "10.500000", "11.000000"}));
  EXPECT_EQ(result.skipped, (Skips{{"damaged image", 4},
                                   {"wrong image size", 1},
                                   {"missing file", 1},
                                   {"short line", 1},
                                   {"not a number", 1}}));
}

TEST(Malformed, EightBitDepthIsTheWrongFormat) {
  // 1 x 1 pixel, 8-bit grey.
  const unsigned char bytes[] = {0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0,    0, 0, 0x0d,
                                 0x49, 0x48, 0x44, 0x52, 0,    0,    0,    1,    0,    0, 0, 1,
                                 8,    0,    0,    0,    0,    0x3a, 0x7e, 0x9b, 0x55, 0, 0, 0,
                                 0x0a, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x60, 0, 0, 0,
                                 2,    0,    1,    0x48, 0xaf, 0xa4, 0x71, 0,    0,    0, 0, 0x49,
                                 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  const std::string image(bytes, bytes + sizeof bytes);
  std::string why;
  EXPECT_FALSE(decode_png_depth(image, 1, 1, why).has_value());
  EXPECT_EQ(why, "wrong image format");
  EXPECT_TRUE(decode_png_grey(image, 1, 1, why).has_value());
}

TEST(Malformed, NothingUsableNamesTheReasons) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", kCalibration);
  folder.write("depth.txt", "1.0 absent.png\n2.0 absent.png\n");
  EXPECT_EQ(message_of([&] { open_recording(folder.path().string()); }),
            folder.path().string() +
                ": found nothing usable (2 x missing file, first depth.txt: 'absent.png'), "
                "expected depth.txt, left.txt and right.txt, or scans.csv with what they list");
  folder.write("depth.txt", "1.0 cut.png\n");
  folder.write("cut.png", png().substr(0, 50));
  EXPECT_EQ(message_of([&] { read_all(folder.path().string()); }),
            folder.path().string() +
                ": found nothing usable (1 x damaged image, first cut.png: 4 x 3, 16 bit grey, "
                "calibration.yaml has 4 x 3), expected depth.txt, left.txt and right.txt, or "
                "scans.csv with what they list");
}

TEST(Malformed, NothingUsableShowsTheFirstCase) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", kCalibration);
  const auto complaint = [&] { return message_of([&] { read_all(folder.path().string()); }); };
  folder.write("large.png", encode_png_depth({5, 3, std::vector<std::uint16_t>(15, 1)}));
  folder.write("depth.txt", "1.0 large.png\n");
  EXPECT_NE(complaint().find("(1 x wrong image size, first large.png: 5 x 3, 16 bit grey, "
                             "calibration.yaml has 4 x 3)"),
            std::string::npos)
      << complaint();
  folder.write("depth.txt", "# no stamps\ndepth/1.png\ndepth/2.png\n");
  EXPECT_NE(complaint().find("(2 x not a number, first depth.txt:2: 'depth/1.png')"),
            std::string::npos)
      << complaint();
  std::filesystem::remove(folder.path() / "depth.txt");
  folder.write("scans.csv", "1700000000000000000,-1,0.5,0.1,10,1,2\n");  // nanoseconds
  EXPECT_NE(complaint().find("first scans.csv:1: '1700000000000000000'"), std::string::npos)
      << complaint();
  folder.write("scans.csv", "1.0,-1,0.5,10,0.1,1,2\n2.0,-1,0.5,10,0.1,1,2\n");
  EXPECT_NE(complaint().find("(2 x range_max not above range_min, first "
                             "scans.csv:1: '1.0,-1,0.5,10,0.1,1,2')"),
            std::string::npos)
      << complaint();
}

TEST(Malformed, ScansAreSkippedAndCounted) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  folder.write(
      "scans.csv",
      "# scans\n1.0,-1,0.5,0.1,10,1,2,nan\n2.0,-1,0.5,0.1,10\n3.0,-1,0.5,0.1,10,1,x,3\n"
      "4.0,-1,0.5\n5.0,-1,0,0.1,10,1,2\n1.5,-1,0.5,0.1,10,1,2,3\n6.0,0,0.5,0.1,10,inf,0\n");
  const Result result = read_all(folder.path().string());
  // The stamp that goes back stands between those of the lines about it.
  EXPECT_EQ(result.stamps, (std::vector<std::string>{"1.000000", "5.500000", "6.000000"}));
  EXPECT_EQ(result.skipped, (Skips{{"short line", 2}, {"not a number", 2}}));
}

TEST(Malformed, ScansThatGoAwayWhileTheyAreRead) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  std::string text;
  for (int i = 1; i < 2000; ++i) text += std::to_string(i) + ".0,-1,0.5,0.1,10,1,2,3\n";
  folder.write("scans.csv", text);
  const auto recording = open_recording(folder.path().string());
  ASSERT_TRUE(recording->next());
  std::filesystem::resize_file(folder.file("scans.csv"), 100);
  try {
    while (recording->next()) {
    }
    FAIL() << "expected one line of complaint";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("scans.csv"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("nothing that could be read"), std::string::npos);
  }
}

TEST(Malformed, CarmenLinesAreSkippedAndCounted) {
  const TemporaryFolder folder;
  folder.write("robot.log",
               "PARAM something on 1 host 1\n"
               "FLASER 3 1 2 3 0 0 0 0 0 0 1.0 host 1.0\n"
               "FLASER 3 1 2 3 1 0 0 1 0 0 2.0 host 2.0\n"
               "FLASER 4000000000 1 2 3 0 0 0 0 0 0 3.0 host 3.0\n"
               "FLASER 9 1 2 3 0 0 0 0 0 0 4.0 host 4.0\n"
               "FLASER 3 1 two 3 0 0 0 0 0 0 5.0 host 5.0\n"
               "FLASER 3 1 2 3 0 0\n"
               "FLASER 3 1 2 3 0 0 0 0 0 0 1.5 host 1.5\n"
               "FLASER 3 1 2 3 2 0 0 2 0 0 6.0 host 6.0\n"
               "FLASER\nODOM 1 2\nODOM\n");
  const Result result = read_all(folder.file("robot.log"));
  // The stamp that goes back stands between those of the lines about it.
  EXPECT_EQ(result.stamps,
            (std::vector<std::string>{"1.000000", "2.000000", "4.000000", "6.000000"}));
  EXPECT_EQ(result.skipped, (Skips{{"not a number", 3}, {"short line", 4}}));
}

TEST(Malformed, BinaryFilesOfNoKind) {
  const TemporaryFolder folder;
  for (const char* name : {"x.bag", "x.rawlog", "x.oni"}) {
    folder.write(name, "these are not the bytes you are looking for");
    const std::string message = message_of([&] { open_recording(folder.file(name)); });
    EXPECT_EQ(message.find(folder.file(name) + ": found "), 0u) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

std::string mrpt_log(const std::string& name) { return "/usr/share/mrpt/datasets/" + name; }

TEST(Malformed, RawlogCutShortGivesItsBeginning) {
  const std::string whole = mrpt_log("2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
  if (!std::filesystem::exists(whole)) GTEST_SKIP() << whole << " is not here";
  const TemporaryFolder folder;
  folder.write("cut.rawlog", read_file_bytes(whole).substr(0, 100000));
  const Result result = read_all(folder.file("cut.rawlog"));
  EXPECT_GT(result.stamps.size(), 100u);
  EXPECT_LT(result.stamps.size(), 225u);
  EXPECT_EQ(result.skipped, (Skips{{"damaged end of file", 1}}));
}

TEST(Malformed, RawlogDamagedWithinIsRefused) {
  const std::string whole = mrpt_log("tests_rgbd.rawlog");
  if (!std::filesystem::exists(whole)) GTEST_SKIP() << whole << " is not here";
  const TemporaryFolder folder;
  std::string bytes = read_file_bytes(whole);
  for (std::size_t i = 1000; i < bytes.size(); i += 50000) bytes[i] ^= 0x55;
  folder.write("damaged.rawlog", bytes);
  EXPECT_EQ(message_of([&] { open_recording(folder.file("damaged.rawlog")); }),
            folder.file("damaged.rawlog") +
                ": found damaged gzip data, expected an MRPT rawlog whose checksum is right");
}

TEST(Malformed, CloudHeaders) {
  const std::string good =
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n";
  const auto message = [](const std::string& text) {
    return message_of([&] { check_pcd(text, "c.pcd"); });
  };
  EXPECT_EQ(message(good), "");
  const std::string ten_gigabytes =
      replaced(replaced(good, "WIDTH 2", "WIDTH 900000000"), "POINTS 2\nDATA ascii",
               "POINTS 900000000\nDATA binary");
  EXPECT_EQ(message(ten_gigabytes),
            "c.pcd:10: found a claim of 10800000000 bytes, expected at most the file's 12");
  EXPECT_EQ(message(replaced(good, "POINTS 2", "POINTS 3")),
            "c.pcd:10: found 3 POINTS for WIDTH 2 and HEIGHT 1, expected their product");
  EXPECT_EQ(message("hello"), "c.pcd:1: found key 'hello', expected a .pcd header");
  EXPECT_EQ(message(""), "c.pcd:0: found no DATA line, expected a .pcd header");
}

}  // namespace
}  // namespace lamina
