// The program as people run it: the same bytes again, after kill -9, from its own config; sessions
// refined and joined.
#include "apps/program.hpp"

#include <map>
#include <random>

#include <lamina/models/trajectory.hpp>

namespace lamina {
namespace {

using namespace program;

// What must not differ by a byte.
std::map<std::string, std::string> results(const Path& folder) {
  std::map<std::string, std::string> all;
  for (const char* file : {"trajectory.txt", "planes.json"}) all[file] = text_of(folder / file);
  for (const auto& entry : std::filesystem::directory_iterator(folder / "grid")) {
    all["grid/" + entry.path().filename().string()] = text_of(entry.path());
  }
  return all;
}

TEST(Run, ASessionIsNotJoinedWithItself) {
  const Path log = scratch() / "twice.log";
  EXPECT_EQ(run({"refine", mapped(1), mapped(1), "--output", scratch() / "twice", "--quiet"}, log),
            2);
  EXPECT_NE(text_of(log).find("a second time"), std::string::npos) << text_of(log);
}

TEST(Run, SameBytesAtAnyThreadsAndFromItsOwnConfig) {
  const auto expected = results(mapped(1));
  ASSERT_GE(expected.size(), 6u);
  for (const auto& [file, text] : expected) EXPECT_FALSE(text.empty()) << file;
  const Path again = scratch() / "again";
  ASSERT_EQ(run({"map", room(1), "-o", again, "--threads", "1", "--quiet"}), 0);
  EXPECT_TRUE(results(again) == expected) << "--threads 1";
  ASSERT_EQ(
      run({"map", room(1), "--output", again, "--config", mapped(1) / "config.yaml", "--quiet"}),
      0);
  EXPECT_TRUE(results(again) == expected) << "--config config.yaml";
}

// Kills at ten random moments of a run (over both modes), goes on each time.
void kill_and_resume(const std::string& mode) {
  const Path whole = scratch() / ("whole_" + mode), broken = scratch() / ("broken_" + mode);
  const std::vector<std::string> common{"--mode", mode, "--quiet", "--set",
                                        "checkpoint.interval_s=0.05"};
  const auto command = [&](const Path& output) {
    std::vector<std::string> arguments{"map", room(1), "--output", output};
    arguments.insert(arguments.end(), common.begin(), common.end());
    return arguments;
  };
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(run(command(whole)), 0);
  auto took = std::chrono::steady_clock::now() - begin;
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> share(0.05, 0.95);
  int killed = 0;
  for (int i = 0; i < 5; ++i) {
    auto arguments = command(broken);
    arguments.emplace_back("--resume");
    const pid_t child = start(arguments);
    ::usleep(static_cast<useconds_t>(share(engine) *
                                     std::chrono::duration<double, std::micro>(took).count()));
    ::kill(child, SIGKILL);
    const bool came_in_time = wait_for(child) == -SIGKILL;
    killed += came_in_time ? 1 : 0;
    if (!came_in_time) took /= 4;  // the machine was busier before
  }
  EXPECT_GT(killed, 0);
  auto arguments = command(broken);
  arguments.emplace_back("--resume");
  ASSERT_EQ(run(arguments), 0);
  EXPECT_TRUE(results(broken) == results(whole)) << mode;
  EXPECT_FALSE(std::filesystem::exists(broken / ".checkpoint"));
}

TEST(Run, KilledOfflineRunsGoOnToTheSameBytes) { kill_and_resume("offline"); }
TEST(Run, KilledOnlineRunsGoOnToTheSameBytes) { kill_and_resume("online"); }

TEST(Run, RefinedSessionKeepsThePath) {
  const Path refined = scratch() / "refined";
  // What an earlier map in the folder was worth says nothing of this one.
  std::filesystem::create_directories(refined);
  std::ofstream(refined / "evaluation.json") << "{}";
  ASSERT_EQ(run({"refine", mapped(1), "--output", refined, "--quiet"}), 0);
  EXPECT_FALSE(std::filesystem::exists(refined / "evaluation.json"));
  const Trajectory before = Trajectory::read_tum(mapped(1) / "trajectory.txt");
  const Trajectory after = Trajectory::read_tum(refined / "trajectory.txt");
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    ASSERT_LT((before[i].pose.inverse() * after[i].pose).log().norm(), 1e-4);
  }
  for (const char* file :
       {"planes.json", "planes.ply", "surfels.ply", "grid/height.tiff", "map.png", "occupancy.pgm",
        "scans.csv", "graph.g2o", "session.lamina", "metrics.json", "config.yaml", "report.html"}) {
    EXPECT_TRUE(std::filesystem::exists(refined / file)) << file;
  }
  const auto lines = [](const std::string& text) {
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines(text_of(refined / "scans.csv")), lines(text_of(mapped(1) / "scans.csv")));
}

TEST(Run, SessionsOfOneRoomAreJoined) {
  const Path joined = scratch() / "joined";
  ASSERT_EQ(run({"refine", mapped(1), mapped(2), "--output", joined, "--quiet"}), 0);
  const Trajectory one = Trajectory::read_tum(mapped(1) / "trajectory.txt");
  const Trajectory two = Trajectory::read_tum(joined / "trajectory_2.txt");
  const Trajectory all = Trajectory::read_tum(joined / "trajectory.txt");
  EXPECT_EQ(all.size(), one.size() + two.size());
  // Both runs drive the same path: truth is common to them up to their centimetre.
  const Trajectory truth = Trajectory::read_tum(room(2) / "groundtruth.txt");
  const Trajectory truth_one = Trajectory::read_tum(room(1) / "groundtruth.txt");
  const auto start_one = truth_one.at(one.front().stamp);
  ASSERT_TRUE(start_one);
  const SE3 T_map_truth = one.front().pose * start_one->inverse();
  for (const StampedPose& p : two) {
    const auto expected = truth.at(p.stamp);
    if (!expected) continue;
    EXPECT_LT((T_map_truth * *expected).translation().x() - p.pose.translation().x(), 0.03);
    ASSERT_LT(((T_map_truth * *expected).translation() - p.pose.translation()).norm(), 0.03);
  }
}

TEST(Run, RefiningInPlaceKeepsTheCalibrationThatWasFound) {
  const Path map = scratch() / "in_place";
  std::filesystem::copy(mapped(1), map, std::filesystem::copy_options::recursive);
  const std::string found = text_of(map / "calibration_found.yaml");
  ASSERT_EQ(run({"refine", map, "--output", map, "--quiet"}), 0);
  EXPECT_EQ(text_of(map / "calibration_found.yaml"), found);
}

TEST(Run, SessionsThatShareNothingAreRefusedInOneLine) {
  const Path hole = scratch() / "hole", map = scratch() / "map_hole", log = scratch() / "log";
  ASSERT_EQ(run({"simulate", "hole", "--output", hole, "--duration", "2", "--quiet"}), 0);
  ASSERT_EQ(run({"map", hole, "--output", map, "--quiet"}), 0);
  EXPECT_EQ(run({"refine", mapped(1), map, "--output", scratch() / "none", "--quiet"}, log), 2);
  const std::string said = text_of(log);
  EXPECT_NE(said.find("found no place for it in"), std::string::npos) << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1);
}

TEST(Run, CheckpointOfAnotherRunIsRefused) {
  const Path output = scratch() / "other", log = scratch() / "log_other";
  const pid_t child =
      start({"map", room(1), "--output", output, "--quiet", "--set", "checkpoint.interval_s=0.02"});
  await(output / ".checkpoint" / "state");
  ::kill(child, SIGKILL);
  wait_for(child);
  ASSERT_TRUE(std::filesystem::exists(output / ".checkpoint" / "state"));
  EXPECT_EQ(run({"map", room(1), "--output", output, "--quiet", "--resume", "--seed", "9"}, log),
            2);
  EXPECT_NE(text_of(log).find("found a checkpoint of another run (seed: 1 there, 9 here)"),
            std::string::npos)
      << text_of(log);
}

}  // namespace
}  // namespace lamina
