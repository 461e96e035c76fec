// Simulated drives mapped, planned on, and held against the true ground.
#include <gtest/gtest.h>

#include <filesystem>

#include <lamina/pipeline/evaluation/evaluation.hpp>

#include <lamina/grid/planner.hpp>
#include <lamina/io/grid_files.hpp>
#include <lamina/sim/dataset.hpp>
#include <lamina/sim/truth.hpp>

#include "pipeline/run_map.hpp"

namespace lamina {
namespace {

namespace fs = std::filesystem;

struct Drive {
  Drive(const std::string& scene, const sim::Parameters& parameters, double seconds) {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder = fs::temp_directory_path() / (std::string("lamina_grid_") + info->name());
    fs::remove_all(folder);
    sim::DatasetOptions options;
    options.seed = 3;
    options.max_duration = seconds;
    sim::write_dataset(sim::load_scene(scene, parameters), (folder / "data").string(), options);
    MapRequest request;
    request.input = (folder / "data").string();
    request.output = folder / "map";
    EXPECT_TRUE(run_map(request));
    grid = io::read_grid(folder / "map" / "grid").grid;
    truth = *sim::read_truth(folder / "data");
  }
  ~Drive() { fs::remove_all(folder); }

  bool truly_free(const Eigen::Vector2d& p) const {
    const sim::TruthGrid& g = truth.grid;
    const int i = static_cast<int>(std::floor((p.x() - g.x0) / g.resolution));
    const int j = static_cast<int>(std::floor((p.y() - g.y0) / g.resolution));
    return i >= 0 && j >= 0 && i < g.width && j < g.height && g.navigability[g.index(i, j)] >= 0.5F;
  }

  fs::path folder;
  NavigabilityGrid grid;
  sim::Truth truth;
};

void expect_truly_free(const Drive& drive, const Plan& plan) {
  ASSERT_EQ(plan.status, PlanStatus::kFound) << plan.reason;
  for (const Eigen::Vector2d& p : plan.path_map) EXPECT_TRUE(drive.truly_free(p)) << p.transpose();
}

TEST(GridEndToEnd, APathRoundATableNeverLeavesTrulyFreeGround) {
  const Drive drive("room", {{"path.speed", "1.2"}}, 0);
  const auto evaluated = evaluate(drive.folder / "map", drive.folder / "data");
  ASSERT_TRUE(evaluated.grid);
  EXPECT_EQ(evaluated.grid->false_free_pits, 0);
  EXPECT_LE(evaluated.grid->false_free_share, 0.002);
  EXPECT_LE(evaluated.grid->false_blocked_share, 0.01);
  EXPECT_LE(evaluated.grid->height_rms_m, 0.005);
  // The table stands in between.
  expect_truly_free(drive, plan_path(drive.grid, {-1.5, -1.2}, {1.5, 1.2}));
  expect_truly_free(drive, plan_path(drive.grid, {0, -1.5}, {0, 1.5}));
}

// Too small for surfels: in holes of these stands the floor's plane, unless images say otherwise.
TEST(GridEndToEnd, SmallLowBoxesAreNotFree) {
  const Drive drive(LAMINA_SOURCE_DIR "/docs/scenes/small_boxes.yaml", {}, 0);
  const auto evaluated = evaluate(drive.folder / "map", drive.folder / "data");
  ASSERT_TRUE(evaluated.grid);
  EXPECT_GT(evaluated.grid->called_free, 3000);
  EXPECT_EQ(evaluated.grid->false_free, 0);
  EXPECT_EQ(evaluated.grid->false_blocked, 0);
}

TEST(GridEndToEnd, APathAcrossAHoleGoesRoundIt) {
  const Drive drive("hole",
                    {{"camera.height_m", "0.8"},
                     {"camera.pitch_deg", "25"},
                     {"hole.size_m", "0.8"},
                     {"hole.distance_m", "1.8"},
                     {"path.advance_m", "0.9"}},
                    0);
  const auto evaluated = evaluate(drive.folder / "map", drive.folder / "data");
  ASSERT_TRUE(evaluated.grid);
  EXPECT_EQ(evaluated.grid->false_free_pits, 0);
  EXPECT_EQ(evaluated.grid->false_free_deep, 0);  // at borders of free ground alone
  EXPECT_LE(evaluated.grid->false_free_share, 0.003);
  EXPECT_LE(evaluated.grid->false_blocked_share, 0.02);
  PlannerOptions options;
  options.robot_radius = 0.2;
  const Plan plan = plan_path(drive.grid, {1.2, 0}, {3.2, 0}, options);
  expect_truly_free(drive, plan);
  double aside = 0;
  for (const Eigen::Vector2d& p : plan.path_map) {
    if (p.x() > 1.9 && p.x() < 2.5) aside = std::max(aside, std::abs(p.y()));
    EXPECT_FALSE(p.x() > 1.8 && p.x() < 2.6 && std::abs(p.y()) < 0.5) << p.transpose();
  }
  EXPECT_GT(aside, 0.55);
}

}  // namespace
}  // namespace lamina
