// One simulated robot as folder, ROS 1 bag, .db3 and .mcap: the same measurements, to the bit.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/bag_contents.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sim/dataset.hpp>

namespace lamina::sim {
namespace {

namespace fs = std::filesystem;

// What messages cannot hold is left out: angles and limits are floats, depth is in millimetres.
World robot(const std::string& scene) {
  World world = make_scene(scene, {{"lidar.enabled", "on"},
                                   {"camera.enabled", "on"},
                                   {"camera.depth_scale", "1000"},
                                   {"accelerometer.enabled", "on"}});
  LidarGeometry& lidar = world.rig.lidar->geometry;
  lidar.angle_min = -2.25;
  lidar.angle_increment = 1.0 / 64;
  lidar.beams = 289;
  lidar.range_min = 0.0625;
  return world;
}

// Of a folder's calibration what a bag does not hold.
fs::path noise_of(const fs::path& folder) {
  std::ifstream in(folder / "calibration.yaml");
  std::ofstream out(folder / "noise.yaml");
  for (std::string line; std::getline(in, line);) {
    bool kept = line.rfind("lidar:", 0) == 0 || line.rfind("odometry:", 0) == 0;
    for (const char* key : {"  range_sigma", "  sigma_", "  planar"})
      kept = kept || line.rfind(key, 0) == 0;
    if (kept) out << line << "\n";
  }
  return folder / "noise.yaml";
}

template <class Values>
void put(std::ostream& out, const Values& values) {
  for (const auto& value : values) out << ' ' << static_cast<double>(value);
}

void put(std::ostream& out, const SE3& T) {
  put(out, T.translation());
  put(out, T.so3().quaternion().coeffs());
}

// Every number of it, in hexadecimal.
std::string text_of(const Measurement& measurement) {
  std::ostringstream out;
  out << std::hexfloat << measurement.index() << ' ' << stamp_of(measurement).nanoseconds();
  if (const auto* scan = std::get_if<LaserScan>(&measurement)) {
    put(out, std::array{scan->angle_min, scan->angle_increment, scan->range_min, scan->range_max,
                        scan->lidar.noise.range_sigma, scan->time_increment});
    put(out, scan->lidar.T_body_lidar);
    put(out, scan->ranges);
  } else if (const auto* depth = std::get_if<DepthFrame>(&measurement)) {
    const CameraModel& c = depth->camera.camera;
    put(out, std::array{c.fx, c.fy, c.cx, c.cy, depth->camera.depth_scale,
                        depth->camera.noise.sigma_depth(3)});
    put(out, c.T_body_camera);
    put(out, depth->raw);
  } else if (const auto* odometry = std::get_if<Odometry>(&measurement)) {
    put(out, odometry->T_odom_body);
  } else if (const auto* sample = std::get_if<Accelerometer>(&measurement)) {
    put(out, sample->acceleration_body);
  }
  return out.str();
}

std::vector<std::string> read(const fs::path& input, const std::optional<fs::path>& calibration) {
  RecordingOptions options;
  options.calibration = calibration;
  const auto recording = open_recording(input.string(), options);
  std::vector<std::string> all;
  while (const auto measurement = recording->next()) all.push_back(text_of(*measurement));
  EXPECT_TRUE(recording->warnings().empty());
  all.push_back(to_yaml(recording->calibration()));
  return all;
}

class DatasetFormats : public ::testing::TestWithParam<const char*> {};

TEST_P(DatasetFormats, HoldTheSameMeasurements) {
  const fs::path folder =
      fs::temp_directory_path() / ("lamina_formats_" + std::to_string(getpid()) + "_" + GetParam());
  DatasetOptions options;
  options.grid = false;
  options.max_duration = 1;
  const DatasetCounts counts = write_dataset(robot(GetParam()), folder / "folder", options);
  EXPECT_GT(counts.scans, 5);
  EXPECT_GE(counts.depth_frames, 3);
  const auto expected = read(folder / "folder", std::nullopt);
  for (const char* name : {"bag", "db3", "mcap"}) {
    options.format = dataset_format(name);
    write_dataset(robot(GetParam()), folder / name, options);
    const fs::path input =
        folder / name / (std::string(name) == "bag" ? "recording.bag" : "recording");
    const auto found = read(input, noise_of(folder / name));
    ASSERT_EQ(found.size(), expected.size()) << name;
    for (std::size_t i = 0; i < found.size(); ++i)
      ASSERT_EQ(found[i].substr(0, 400), expected[i].substr(0, 400)) << name;
    EXPECT_EQ(found, expected) << name;
    const std::string contents = describe_bag(input.string());
    for (const char* part :
         {"289 beams", "640 x 480 px, 16UC1", "laser  (fixed)", "body 'base_link'"})
      EXPECT_NE(contents.find(part), std::string::npos) << part << " in\n" << contents;
    EXPECT_EQ(contents.find("missing"), std::string::npos) << contents;
  }
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Worlds, DatasetFormats, ::testing::Values("room", "office"));

TEST(DatasetFormat, NamesAreChecked) {
  EXPECT_EQ(dataset_format("mcap"), DatasetFormat::kMcap);
  EXPECT_THROW(dataset_format("rosbag"), Error);
}

}  // namespace
}  // namespace lamina::sim
