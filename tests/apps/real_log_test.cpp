// A real log of a level scanner through the program: what its map must not hold.
#include "apps/program.hpp"

#include <algorithm>
#include <cstdlib>

#include <nlohmann/json.hpp>

namespace lamina {
namespace {

using namespace program;

// Where recordings are that do not belong to the project.
Path recordings() {
  const char* set = std::getenv("LAMINA_DATA");
  return set ? set : LAMINA_SOURCE_DIR "/../shared/data";
}

// A plane of a level scanner that tilts fits more lines the flatter it lies, all of them in the
// end.
void expect_upright_walls(const Path& log) {
  const Path map = scratch() / "real";
  ASSERT_EQ(run({"map", log, "--output", map, "--quiet"}), 0);
  EXPECT_NE(text_of(map / "config.yaml").find("preset: wheeled_lidar\n"), std::string::npos);
  const auto planes = nlohmann::json::parse(text_of(map / "planes.json")).at("planes");
  ASSERT_GT(planes.size(), 20u);
  for (const auto& plane : planes) {
    EXPECT_LT(std::abs(plane.at("normal").at(2).get<double>()), 0.5) << plane.at("id");
  }
}

const Path kSena =
    "/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog";

TEST(RealLog, WallsThatComeBackToTheWindowStayUpright) {
  if (!std::filesystem::exists(kSena)) GTEST_SKIP() << kSena << " is absent (mrpt-common)";
  expect_upright_walls(kSena);
}

// Loops closed in line or beside, the wheels' scale looked for early or late.
TEST(RealLog, AScannersMapIsTheSameAtAnyThreads) {
  if (!std::filesystem::exists(kSena)) GTEST_SKIP() << kSena << " is absent (mrpt-common)";
  const Path one = scratch() / "one", two = scratch() / "two";
  ASSERT_EQ(run({"map", kSena, "--output", one, "--threads", "1", "--quiet"}), 0);
  ASSERT_EQ(run({"map", kSena, "--output", two, "--threads", "2", "--quiet"}), 0);
  for (const char* file : {"trajectory.txt", "planes.json", "graph.g2o", "occupancy.pgm"}) {
    EXPECT_FALSE(text_of(one / file).empty()) << file;
    EXPECT_TRUE(text_of(one / file) == text_of(two / file)) << file;
  }
}

// Its player bears no second one beside it: a first look at the images must be over by then.
TEST(RealLog, AllFramesOfAnOpenNiRecordingAreMapped) {
  const Path recording = recordings() / "openni_kinect" / "recording.oni";
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << recording << " is absent";
  const Path map = scratch() / "oni";
  ASSERT_EQ(run({"map", recording, "--output", map, "--quiet"}), 0);
  const std::string poses = text_of(map / "trajectory.txt");
  EXPECT_EQ(
      std::count(poses.begin(), poses.end(), '\n') - std::count(poses.begin(), poses.end(), '#'),
      12);
}

// A scanner of ten revolutions a second that looks 240 degrees around: 67 ms from the first beam to
// the last, which the log does not say. Its wheels' stamps are early by more than a scan.
TEST(RealLog, ASlowScannersSweepAndClockAreTold) {
  const Path log = recordings() / "mines_exp1" / "exp1.log";
  if (!std::filesystem::exists(log)) GTEST_SKIP() << log << " is absent";
  const Path map = scratch() / "mines";
  ASSERT_EQ(run({"map", log, "--output", map, "--quiet"}), 0);
  const auto counts = nlohmann::json::parse(text_of(map / "metrics.json")).at("counts");
  EXPECT_NEAR(counts.value("scanner_sweep_ms", 0.0), 67, 15);
  EXPECT_GT(counts.value("odometry_clock_ms", 0.0), 100);
}

// A cheap scanner, whose lines of one wall contradict each other by degrees; from a place on where
// that had laid three walls flat.
TEST(RealLog, WallsOfContradictingLinesStayUpright) {
  const Path log = recordings() / "mines_exp1" / "exp1.log";
  if (!std::filesystem::exists(log)) GTEST_SKIP() << log << " is absent";
  std::ifstream in(log);
  const Path rest = scratch() / "rest.log";
  std::ofstream out(rest);
  std::string line;
  for (int i = 0; std::getline(in, line); ++i) {
    if (i >= 120) out << line << "\n";  // a line of odometry and one of ranges a scan
  }
  out.close();
  expect_upright_walls(rest);
}

}  // namespace
}  // namespace lamina
