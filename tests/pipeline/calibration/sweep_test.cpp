// A scanner whose beam takes a tenth of a second, of which the recording says nothing.
#include <nlohmann/json.hpp>

#include <lamina/pipeline/calibration/report.hpp>

#include <lamina/sensors/recording.hpp>

#include "pipeline/faulty_room.hpp"
#include "pipeline/run_map.hpp"

namespace lamina {
namespace {

void simulate_slow_scans(const fs::path& data) {
  sim::DatasetOptions options;
  options.grid = false;
  sim::write_dataset(
      sim::make_scene("room",
                      {{"camera.enabled", "false"}, {"lidar.sweep_s", "0.1"}, {"path.laps", "2"}}),
      data, options);
}

TEST(UnknownSweep, IsFoundAndTakenOut) {
  const Folder folder;
  simulate_slow_scans(folder.path() / "data");
  const Outcome outcome = map_and_evaluate(folder, folder.path() / "data");
  EXPECT_LT(outcome.ate, 0.01);
}

TEST(UnknownSweep, IsFoundOnTheWayOnline) {
  const Folder folder;
  simulate_slow_scans(folder.path() / "data");
  MapRequest request;
  request.input = (folder.path() / "data").string();
  request.output = folder.path() / "map";
  request.online = true;
  ASSERT_TRUE(run_map(request));
  std::ifstream in(request.output / "metrics.json");
  const auto counts = nlohmann::json::parse(in)["counts"];
  ASSERT_TRUE(counts.contains("scanner_sweep_ms"));
  EXPECT_NEAR(counts["scanner_sweep_ms"].get<double>(), 100, 15);
}

TEST(UnknownSweep, WheelsAfterTheScanTellItsMotion) {
  const Folder folder;
  simulate_slow_scans(folder.path() / "data");
  const auto data = open_recording((folder.path() / "data").string());
  const WheelTrack wheels = all_wheels(*data, [] { return false; });
  const auto middle = Timestamp::from_seconds(kStart + 10);
  ASSERT_TRUE(wheels.velocity(middle, middle + 0.1));
  EXPECT_GT(wheels.velocity(middle, middle + 0.1)->norm(), 0.1);
}

}  // namespace
}  // namespace lamina
