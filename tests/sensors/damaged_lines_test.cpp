// Lines of recordings that are cut, and scans that cannot be: left out, counted, told with a place.
#include <gtest/gtest.h>

#include <lamina/models/error.hpp>
#include <lamina/sensors/recording.hpp>

#include "sensors/temporary_folder.hpp"

namespace lamina {
namespace {
using test::TemporaryFolder;
using Skips = SkippedCounts;

struct Result {
  std::size_t scans = 0;
  Skips skipped;
  std::map<std::string, std::string> firsts;
  std::string message;  // of what was thrown
};

Result read_all(const std::string& input) {
  Result result;
  try {
    const auto recording = open_recording(input);
    while (const auto m = recording->next()) result.scans += std::holds_alternative<LaserScan>(*m);
    result.skipped = recording->skipped();
    result.firsts = recording->first_skipped();
  } catch (const Error& error) {
    result.message = error.what();
  }
  return result;
}

std::string scan_line(std::string text, int ranges) {
  text += ",0.1,10";
  for (int k = 0; k < ranges; ++k) text += ",1.25";
  return text + "\n";
}

std::string scan_lines(int count, int ranges) {
  std::string text;
  for (int i = 1; i <= count; ++i) text += scan_line(std::to_string(i) + ".5,-1,0.5", ranges);
  return text;
}

TEST(DamagedLines, ScansOfMoreThanATurnAreSkippedAndToldWithTheirPlace) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  // 13 beams half a radian apart end short of the first again, 14 pass it by 0.2 rad, 15 by more.
  folder.write("scans.csv",
               scan_lines(4, 14) + scan_line("8.0,-1,-0.5", 15) + "9.0,-1,1,0.1,10,1,1\n");
  const Result result = read_all(folder.path().string());
  EXPECT_EQ(result.scans, 5u);
  EXPECT_EQ(result.skipped, (Skips{{"scan over more than one turn", 1}}));
  EXPECT_EQ(result.firsts.at("scan over more than one turn"),
            "scans.csv:5: found 15 beams -0.5 rad apart, 7 rad in all, expected one turn (6.28319 "
            "rad) at most");
  folder.write("scans.csv", "1.0,-90,1,0.1,10,1,2,3,4,5,6,7,8,9\n");  // degrees
  EXPECT_NE(
      read_all(folder.path().string())
          .message.find("(1 x scan over more than one turn, first scans.csv:1: found 9 beams 1 rad "
                        "apart, 8 rad in all, expected one turn (6.28319 rad) at most)"),
      std::string::npos);
}

TEST(DamagedLines, CarmenScansOfMoreThanATurn) {
  const TemporaryFolder folder;
  const std::string rest = " 10 0.01 0 9 1 1 1 1 1 1 1 1 1 0 0 0 0 0 0 0 0 0 0 0 0 1.0 host 1.0\n";
  folder.write("robot.log", "ODOM 0 0 0 0 0 0 1.0 host 1.0\nROBOTLASER1 0 -90 180 1" + rest);
  const auto recording = open_recording(folder.file("robot.log"));
  EXPECT_EQ(recording->first_skipped().at("scan over more than one turn").substr(0, 45),
            "robot.log:2: found 9 beams 1 rad apart, 8 rad");
  folder.write("robot.log", "ROBOTLASER1 0 -90 180 1" + rest);
  EXPECT_NE(read_all(folder.file("robot.log"))
                .message.find(
                    "found no laser scan and no odometry (1 x scan over more than one turn, first "
                    "line 1: found 9 beams"),
            std::string::npos);
}

TEST(DamagedLines, CutScanLinesAreSkippedAndCounted) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  const std::string whole = scan_lines(5, 6);
  folder.write("scans.csv", whole.substr(0, whole.size() - 12));  // a recorder that was killed
  Result result = read_all(folder.path().string());
  EXPECT_EQ(result.scans, 4u);
  EXPECT_EQ(result.skipped, (Skips{{"cut scan line", 1}}));
  folder.write("scans.csv", whole.substr(0, whole.size() - 1));  // only the line's end lacks
  result = read_all(folder.path().string());
  EXPECT_EQ(result.scans, 5u);
  EXPECT_TRUE(result.skipped.empty());
  // A full disk in between.
  folder.write("scans.csv", whole + "6.5,-1,0.5,0.1,10,1,2\n7.5,-1,0.5,0.1,10,1,1,1,1,1,1\n");
  const auto recording = open_recording(folder.path().string());
  EXPECT_EQ(recording->skipped(), (Skips{{"cut scan line", 1}}));
  EXPECT_EQ(recording->first_skipped().at("cut scan line"),
            "scans.csv:6: found 2 ranges, expected 6 as in other lines of its angles");
  // A scanner whose scans have any length.
  folder.write("scans.csv",
               "1,-1,0.5,0.1,10,1,2\n2,-1,0.5,0.1,10,1,2,3\n3,-1,0.5,0.1,10,1,2\n"
               "4,-1,0.5,0.1,10,1,2,3\n5,-1,0.5,0.1,10,1,2,3\n6,0,0.5,0.1,10,1,2\n");
  EXPECT_EQ(read_all(folder.path().string()).scans, 6u);
}

// Wherever the end is cut off, what is left out is counted and what stays lacks nothing but digits
// of the last range.
TEST(DamagedLines, AScansFileCutAnywhereLosesOneLineAtMost) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  const std::string whole = scan_lines(3, 4), two = scan_lines(2, 4);
  for (std::size_t size = two.size() + 1; size < whole.size(); ++size) {
    folder.write("scans.csv", whole.substr(0, size));
    const auto recording = open_recording(folder.path().string());
    std::size_t scans = 0;
    while (const auto m = recording->next()) {
      EXPECT_EQ(std::get<LaserScan>(*m).size(), 4u) << size;
      ++scans;
    }
    std::int64_t skipped = 0;
    for (const auto& [why, count] : recording->skipped()) skipped += count;
    EXPECT_EQ(scans + static_cast<std::size_t>(skipped), 3u) << size;
    EXPECT_GE(scans, 2u) << size;
  }
}

TEST(DamagedLines, AnOdometryLineCutInItsLastNumber) {
  const TemporaryFolder folder;
  folder.write("calibration.yaml", "lidar: {range_sigma: 0.01}\n");
  folder.write("scans.csv", scan_lines(3, 4));
  const std::string lines = "1.5 0 0 0 0 0 0 1\n2.5 0 0 0 0 0 0.3826834 0.9238795";
  folder.write("odometry.txt", lines);
  EXPECT_TRUE(open_recording(folder.path().string())->skipped().empty());
  folder.write("odometry.txt", lines.substr(0, lines.size() - 6));  // 0.9
  const auto recording = open_recording(folder.path().string());
  EXPECT_EQ(recording->skipped(), (Skips{{"short line", 1}}));
  EXPECT_EQ(recording->first_skipped().at("short line").substr(0, 15), "odometry.txt:2:");
}

}  // namespace
}  // namespace lamina
