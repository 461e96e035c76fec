// A room seen by scanner and camera one of whose clocks is off the wheels'.
#include <nlohmann/json.hpp>

#include <lamina/pipeline/calibration/time_offset.hpp>

#include "pipeline/faulty_room.hpp"
#include "pipeline/run_map.hpp"

namespace lamina {
namespace {

void simulate(const fs::path& data, const char* delayed, const char* seconds) {
  sim::DatasetOptions options;
  options.grid = false;
  sim::write_dataset(sim::make_scene("room", {{"lidar.enabled", "true"},
                                              {"lidar.beams", "271"},
                                              {"camera.width", "320"},
                                              {"camera.height", "240"},
                                              {"camera.rate_hz", "5"},
                                              {delayed, seconds}}),
                     data, options);
}

nlohmann::json counts_of(const Folder& folder) {
  std::ifstream in(folder.path() / "map" / "metrics.json");
  return nlohmann::json::parse(in)["counts"];
}

TEST(Clocks, LateScansAreFoundAndCorrected) {
  const Folder folder;
  simulate(folder.path() / "data", "lidar.delay_s", "0.04");
  const Outcome outcome = map_and_evaluate(folder, folder.path() / "data");
  EXPECT_LT(outcome.ate, 0.005);
  const auto counts = counts_of(folder);
  ASSERT_TRUE(counts.contains("scanner_clock_ms"));
  EXPECT_NEAR(counts["scanner_clock_ms"].get<double>(), -40, 6);
  EXPECT_FALSE(counts.contains("camera_clock_ms"));
}

TEST(Clocks, LateImagesAreFoundAndCorrected) {
  const Folder folder;
  simulate(folder.path() / "data", "camera.delay_s", "0.06");
  map_and_evaluate(folder, folder.path() / "data");
  const auto counts = counts_of(folder);
  ASSERT_TRUE(counts.contains("camera_clock_ms"));
  EXPECT_NEAR(counts["camera_clock_ms"].get<double>(), -60, 10);
  EXPECT_FALSE(counts.contains("scanner_clock_ms"));
}

// Its poses are asked for at its own stamps: the wheels' move, by more than from one to the next.
TEST(Clocks, BesideAScannerAloneTheWheelsMove) {
  for (const auto& [delay, observed] : {std::pair{"0.1", 100.0}, {"0.03", 0.0}}) {
    const Folder folder;
    sim::DatasetOptions options;
    options.grid = false;
    sim::write_dataset(sim::make_scene("room", {{"lidar.enabled", "true"},
                                                {"camera.enabled", "false"},
                                                {"lidar.delay_s", delay}}),
                       folder.path() / "data", options);
    map_and_evaluate(folder, folder.path() / "data");
    const auto counts = counts_of(folder);
    EXPECT_NEAR(counts.value("odometry_clock_ms", 0.0), observed, 10);
    EXPECT_FALSE(counts.contains("scanner_clock_ms"));
  }
}

TEST(Clocks, TheEarliestIsRight) {
  const auto offset = [](double value) { return ClockOffset::Result{value, 0.001, 10}; };
  const ClockOffsets late = by_earliest({offset(-0.04), std::nullopt});
  EXPECT_EQ(late.scanner, -0.04);
  EXPECT_EQ(late.camera, 0);
  EXPECT_EQ(late.odometry, 0);
  const ClockOffsets wheels = by_earliest({offset(0.031), offset(0.029)});
  EXPECT_EQ(wheels.scanner, 0);
  EXPECT_EQ(wheels.camera, 0);
  EXPECT_EQ(wheels.odometry, -0.031);
  const ClockOffsets three = by_earliest({offset(-0.025), offset(0.03)});
  EXPECT_NEAR(three.scanner, -0.055, 1e-12);
  EXPECT_EQ(three.camera, 0);
  EXPECT_EQ(three.odometry, -0.03);
}

// Late odometry beside a camera that could not tell its clock: its stamps were moved along.
TEST(Clocks, ASensorThatToldNothingIsNotAsLateAsTheOdometry) {
  const auto observed = [](double value, double sigma) {
    return ClockOffset::Result{value, sigma, 10};
  };
  FoundClocks found{observed(0.08, 0.001), std::nullopt};
  const ClockOffsets nothing = by_earliest(found);
  EXPECT_EQ(nothing.odometry, -0.08);
  EXPECT_EQ(nothing.scanner, 0);
  EXPECT_EQ(nothing.camera, 0);
  for (const auto& [value, sigma] : {std::pair{0.07, 0.01}, {0.02, 0.03}}) {
    found.camera_observed = observed(value, sigma);
    EXPECT_EQ(by_earliest(found).camera, 0) << value;
  }
  found.camera_observed = observed(0.003, 0.005);
  EXPECT_EQ(by_earliest(found).camera, -0.08);
  const ClockOffsets no_scanner = by_earliest({std::nullopt, observed(0.08, 0.001)});
  EXPECT_EQ(no_scanner.scanner, 0);
  EXPECT_EQ(no_scanner.odometry, -0.08);
}

TEST(Clocks, RightOnesStayAndAStatedDelayIsTakenOff) {
  const Folder folder;
  simulate(folder.path() / "data", "lidar.delay_s", "0.04");
  MapRequest request;
  request.input = (folder.path() / "data").string();
  request.output = folder.path() / "map";
  request.assignments = {"lidar.delay_s=0.04"};
  ASSERT_TRUE(run_map(request));
  const auto counts = counts_of(folder);
  EXPECT_FALSE(counts.contains("scanner_clock_ms"));
  EXPECT_FALSE(counts.contains("camera_clock_ms"));
}

}  // namespace
}  // namespace lamina
