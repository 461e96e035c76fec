// Dataset folders: read back by the recordings, same bytes twice, truth that is true.
#include <lamina/sim/dataset.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include <lamina/models/error.hpp>
#include <lamina/sim/truth.hpp>

namespace lamina::sim {
namespace {

namespace fs = std::filesystem;

class Dataset : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("lamina_sim_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string bytes(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }

  fs::path folder_;
};

const Parameters kAllSensors = {{"stereo.enabled", "on"}, {"accelerometer.enabled", "on"},
                                {"camera.width", "160"},  {"camera.height", "120"},
                                {"stereo.width", "160"},  {"stereo.height", "120"},
                                {"stereo.rate_hz", "1"},  {"camera.rate_hz", "2"}};

DatasetOptions short_run() {
  DatasetOptions options;
  options.max_duration = 1;
  options.labels = true;
  return options;
}

TEST_F(Dataset, ReadsBackAsWhatWasMeasured) {
  const World world = make_scene("room", kAllSensors);
  const DatasetCounts counts = write_dataset(world, folder_, short_run());
  EXPECT_EQ(counts.depth_frames, 3);
  EXPECT_EQ(counts.stereo_pairs, 2);
  EXPECT_EQ(counts.scans, 11);
  EXPECT_EQ(counts.odometry, 21);
  EXPECT_EQ(counts.accelerometer, 51);
  const auto recording = open_recording(folder_.string());
  Simulation simulation(world, 1);
  std::vector<Measurement> waiting;  // measurements of one instant come in any order
  const auto next_like = [&](const Measurement& wanted) -> std::optional<Measurement> {
    for (auto it = waiting.begin(); it != waiting.end(); ++it) {
      if (it->index() == wanted.index() && stamp_of(*it) == stamp_of(wanted)) {
        Measurement found = std::move(*it);
        waiting.erase(it);
        return found;
      }
    }
    while (auto made = simulation.next()) {
      if (made->index() == wanted.index() && stamp_of(*made) == stamp_of(wanted)) return made;
      waiting.push_back(std::move(*made));
    }
    return std::nullopt;
  };
  int compared = 0;
  while (auto read = recording->next()) {
    const auto made = next_like(*read);
    ASSERT_TRUE(made);
    if (const auto* frame = std::get_if<DepthFrame>(&*read)) {
      ASSERT_TRUE(std::holds_alternative<DepthFrame>(*made));
      EXPECT_EQ(frame->raw, std::get<DepthFrame>(*made).raw);
      EXPECT_LT((frame->camera.camera.T_body_camera.inverse() *
                 world.rig.depth->camera.camera.T_body_camera)
                    .log()
                    .norm(),
                1e-6);
      ++compared;
    } else if (const auto* scan = std::get_if<LaserScan>(&*read)) {
      ASSERT_TRUE(std::holds_alternative<LaserScan>(*made));
      const auto& expected = std::get<LaserScan>(*made);
      ASSERT_EQ(scan->size(), expected.size());
      for (std::size_t i = 0; i < scan->size(); ++i) {
        EXPECT_NEAR(scan->ranges[i], expected.ranges[i], 6e-5);
      }
      ++compared;
    } else if (const auto* pair = std::get_if<StereoFrame>(&*read)) {
      EXPECT_EQ(pair->left, std::get<StereoFrame>(*made).left);
      EXPECT_EQ(pair->right, std::get<StereoFrame>(*made).right);
      ++compared;
    } else if (const auto* odometry = std::get_if<Odometry>(&*read)) {
      const SE3& expected = std::get<Odometry>(*made).T_odom_body;
      EXPECT_LT((odometry->T_odom_body.inverse() * expected).log().norm(), 1e-7);
      ++compared;
    }
  }
  EXPECT_EQ(compared, 3 + 2 + 11 + 21);
  EXPECT_TRUE(recording->skipped().empty());
}

TEST_F(Dataset, SameSeedSameBytes) {
  const World world = make_scene("room", kAllSensors);
  write_dataset(world, folder_ / "a", short_run());
  write_dataset(world, folder_ / "b", short_run());
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "a")) {
    if (entry.is_regular_file()) {
      const fs::path twin = folder_ / "b" / fs::relative(entry.path(), folder_ / "a");
      EXPECT_EQ(bytes(entry.path()), bytes(twin)) << entry.path();
      ++files;
    }
  }
  EXPECT_GT(files, 15);
}

TEST_F(Dataset, BelievedCalibrationIsOffByWhatWasAsked) {
  Parameters parameters = kAllSensors;
  parameters["calibration.error_pitch_deg"] = "1.5";
  parameters["calibration.error_x_cm"] = "3";
  write_dataset(make_scene("room", parameters), folder_, short_run());
  const Calibration accepted = read_calibration(folder_ / "calibration.yaml");
  const Calibration truth = read_calibration(folder_ / "calibration_true.yaml");
  const SE3 off = accepted.depth_camera->camera.T_body_camera *
                  truth.depth_camera->camera.T_body_camera.inverse();
  EXPECT_NEAR(off.so3().log().y() * 180 / M_PI, 1.5, 1e-6);
  EXPECT_NEAR(
      accepted.lidar->T_body_lidar.translation().x() - truth.lidar->T_body_lidar.translation().x(),
      0.03, 1e-8);
}

TEST_F(Dataset, TruthReadsBack) {
  World world = make_scene("steps", {{"camera.width", "160"}, {"camera.height", "120"}});
  write_dataset(world, folder_, short_run());
  const auto truth = read_truth(folder_);
  ASSERT_TRUE(truth);
  EXPECT_EQ(truth->scene, "steps");
  ASSERT_EQ(truth->planes.size(), world.scene.planes().size());
  for (std::size_t i = 0; i < truth->planes.size(); ++i) {
    const ScenePlane& p = world.scene.planes()[i];
    EXPECT_EQ(truth->planes[i].name, p.name);
    EXPECT_EQ(truth->planes[i].label, p.label);
    EXPECT_LT(angle_between(truth->planes[i].plane_map, p.plane_map), 1e-7);
    EXPECT_NEAR(truth->planes[i].plane_map.rho(), p.plane_map.rho(), 1e-8);
    EXPECT_EQ(truth->planes[i].outline_map.size(), p.outline_map.size());
  }
  EXPECT_GT(truth->planes[0].hits, 1000);
  EXPECT_GT(truth->grid.width, 100);
  EXPECT_FALSE(read_truth(folder_ / "nowhere"));
  std::ofstream(folder_ / "truth.yaml") << "scene: x\nseed: 1\nplanes:\n  - {id: one}\n";
  EXPECT_THROW(read_truth(folder_), Error);
}

TEST(TruthGrid, StepsHaveTheirHeightsAndTheRobotStaysOffThem) {
  const World world = make_scene("steps");
  const Caster caster(world.scene);
  const TruthGrid grid = grid_truth(world, caster, {});
  const auto at = [&](double x, double y) {
    return grid.index(static_cast<int>((x - grid.x0) / grid.resolution),
                      static_cast<int>((y - grid.y0) / grid.resolution));
  };
  EXPECT_NEAR(grid.surface[at(0, 0)], 0, 1e-6);
  EXPECT_NEAR(grid.surface[at(2.6, 1.2)], 0.02, 1e-6);
  EXPECT_NEAR(grid.surface[at(4.8, -1.2)], 0.10, 1e-6);
  EXPECT_EQ(grid.reachable[at(2.6, 1.2)], 1);   // 2 cm: the robot's largest step
  EXPECT_EQ(grid.reachable[at(2.6, -1.2)], 0);  // 3 cm
  EXPECT_EQ(grid.reachable[at(8.0, 1.2)], 1);   // up the ramp
  EXPECT_EQ(grid.navigability[at(0, 0)], 1);
  EXPECT_NEAR(grid.navigability[at(4.8, -1.2)], 1 - 0.1 / 0.75, 1e-5);
  // Both sides of a step of 3 cm are blocked, and nothing of one of 2 cm.
  EXPECT_EQ(grid.navigability[at(2.02, -1.2)], 0);
  EXPECT_EQ(grid.navigability[at(1.98, -1.2)], 0);
  EXPECT_EQ(grid.navigability[at(1.88, -1.2)], 1);
  EXPECT_GT(grid.navigability[at(2.02, 1.2)], 0.9);
  EXPECT_EQ(grid.navigability[at(1.98, 1.2)], 1);
  // A ramp the robot drives up is worth its slope, however high.
  EXPECT_NEAR(grid.navigability[at(7.9, 1.2)], 1 - 0.8 * 5 / 45, 1e-5);
}

TEST(TruthGrid, HolesAndWallsAreNotNavigable) {
  const World world = make_scene("hole_no_wall");
  const Caster caster(world.scene);
  const TruthGrid grid = grid_truth(world, caster, {});
  const auto at = [&](double x, double y) {
    return grid.index(static_cast<int>((x - grid.x0) / grid.resolution),
                      static_cast<int>((y - grid.y0) / grid.resolution));
  };
  EXPECT_TRUE(std::isnan(grid.surface[at(3, 0)]));
  EXPECT_EQ(grid.navigability[at(3, 0)], 0);
  EXPECT_EQ(grid.reachable[at(3, 0)], 0);
  EXPECT_EQ(grid.reachable[at(5, 0)], 1);
  EXPECT_EQ(grid.navigability[at(1.98, 0)], 0) << "the rim";
  EXPECT_EQ(grid.navigability[at(1.88, 0)], 1);
  const World loop = make_scene("corridor_loop");
  const Caster loop_caster(loop.scene);
  const TruthGrid corridor = grid_truth(loop, loop_caster, {});
  const std::size_t core = corridor.index(static_cast<int>((11 - corridor.x0) / 0.05),
                                          static_cast<int>((7 - corridor.y0) / 0.05));
  const std::size_t pillar = corridor.index(static_cast<int>((21.9 - corridor.x0) / 0.05),
                                            static_cast<int>((4.0 - corridor.y0) / 0.05));
  EXPECT_EQ(corridor.navigability[pillar], 0)
      << "flush against the wall, and taller than the robot";
  EXPECT_EQ(corridor.navigability[core], 0);
  EXPECT_EQ(corridor.reachable[core], 0);
}

TEST(TruthGrid, FlightsHaveNone) {
  const World world = make_scene("flyover");
  EXPECT_EQ(grid_truth(world, Caster(world.scene), {}).width, 0);
}

}  // namespace
}  // namespace lamina::sim
