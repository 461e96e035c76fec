// A map from one's own loop: poses, files, and what becomes of a session that is refined in place.
#include <lamina/pipeline/online_mapper.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include <lamina/pipeline/config/map_request.hpp>
#include <lamina/pipeline/config/settings.hpp>
#include <lamina/pipeline/refine_sessions.hpp>
#include <lamina/pipeline/write_results.hpp>

namespace lamina {
namespace {

namespace fs = std::filesystem;

// A scan in the middle line of a room of 8 x 5 m.
LaserScan scan_at(double x, double time) {
  LaserScan scan;
  scan.stamp = Timestamp::from_seconds(time);
  scan.angle_min = -M_PI;
  scan.angle_increment = 2 * M_PI / 180;
  scan.range_min = 0.1;
  scan.range_max = 20;
  for (int i = 0; i < 180; ++i) {
    const double a = scan.angle(static_cast<std::size_t>(i)) + 1e-3;
    const double to_x = ((std::cos(a) > 0 ? 4 : -4) - x) / std::cos(a);
    const double to_y = (std::sin(a) > 0 ? 2.5 : -2.5) / std::sin(a);
    scan.ranges.push_back(static_cast<float>(std::min(to_x, to_y)));
  }
  return scan;
}

class OnlineMapping : public testing::Test {
 protected:
  OnlineMapping() : folder_(fs::temp_directory_path() / "lamina_online_mapper_test") {
    fs::remove_all(folder_);
    calibration_.lidar.emplace();
    mapper_.emplace(calibration_, preset_options(calibration_));
    for (int i = 0; i < 20; ++i) pose_ = mapper_->add(scan_at(-1 + 0.05 * i, 1 + 0.1 * i));
  }
  ~OnlineMapping() override { fs::remove_all(folder_); }

  fs::path folder_;
  Calibration calibration_;
  std::optional<OnlineMapper> mapper_;
  std::optional<SE3> pose_;
};

TEST_F(OnlineMapping, GivesAPoseForEachScanAndCountsWhatItLeavesOut) {
  ASSERT_TRUE(pose_);
  EXPECT_NEAR(pose_->translation().x(), 0.95, 0.02);
  EXPECT_FALSE(mapper_->add(scan_at(0, 0.5)));
  EXPECT_EQ(mapper_->diagnostics().skipped.size(), 1U);
}

TEST_F(OnlineMapping, SavesAgainAndKeepsNoFilesOfAnotherMap) {
  mapper_->save(folder_);
  std::ofstream(folder_ / "edges.csv") << "of another map";
  std::ofstream(folder_ / "report.html") << "of another map";
  EXPECT_TRUE(mapper_->add(scan_at(0, 3.1)));
  mapper_->save(folder_);
  EXPECT_EQ(Trajectory::read_tum((folder_ / "trajectory.txt").string()).size(), 21U);
  EXPECT_TRUE(fs::exists(folder_ / "session.lamina"));
  EXPECT_FALSE(fs::exists(folder_ / "edges.csv"));
  EXPECT_FALSE(fs::exists(folder_ / "report.html"));
}

// No time for grids or session, as after a signal.
class NoTime : public RunObserver {
 public:
  double seconds_left() const override { return 0; }
};

TEST_F(OnlineMapping, ASessionRefinedInPlaceOutlivesAnInterruption) {
  mapper_->save(folder_);
  const auto options_of = [](const std::string& yaml, const std::string& name) {
    MapOptions options;
    load_text(options, yaml, name);
    options.to_yaml = &to_yaml;
    return options;
  };
  NoTime observer;
  const MapResult result = refine_sessions({folder_}, options_of, folder_, observer);
  EXPECT_FALSE(write_results(folder_, result, observer).whole);
  EXPECT_TRUE(fs::exists(folder_ / "session.lamina"));
  EXPECT_FALSE(fs::exists(folder_ / "grid"));
}

}  // namespace
}  // namespace lamina
