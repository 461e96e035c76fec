// Scans as lines.
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include <lamina/io/scan_files.hpp>

namespace lamina::io {
namespace {

TEST(ScanFiles, WritesOneLineWithZeroForNoReturn) {
  LaserScan scan;
  scan.stamp = *Timestamp::parse("12.5");
  scan.angle_min = -0.5;
  scan.angle_increment = 0.25;
  scan.range_min = 0.1;
  scan.range_max = 10;
  scan.ranges = {1.25f,
                 0.0f,
                 std::numeric_limits<float>::infinity(),
                 20.0f,
                 std::numeric_limits<float>::quiet_NaN(),
                 3.0f};
  std::ostringstream out;
  write_scan(out, scan);
  EXPECT_EQ(out.str(), "12.500000,-0.5,0.25,0.1,10,1.2500,0,0,0,0,3.0000\n");
}

}  // namespace
}  // namespace lamina::io
