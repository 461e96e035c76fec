// The program's contract, line by line: verbs, exit codes, messages, files, keys (docs/formats.md).
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include <lamina/models/trajectory.hpp>

#include "apps/program.hpp"

namespace lamina {
namespace {

using namespace program;
using testing::HasSubstr;

struct Outcome {
  int code = 0;
  std::string log, out;
};

Outcome outcome(const std::vector<std::string>& arguments) {
  const Path log = scratch() / "contract.log", out = scratch() / "contract.out";
  Outcome o;
  o.code = run(arguments, log, out);
  o.log = text_of(log);
  o.out = text_of(out);
  return o;
}

// Exit 2 and one line that holds these words.
void expect_usage(const std::vector<std::string>& arguments, const std::string& words) {
  const Outcome o = outcome(arguments);
  EXPECT_EQ(o.code, 2) << words;
  EXPECT_THAT(o.log, HasSubstr(words));
  EXPECT_EQ(std::count(o.log.begin(), o.log.end(), '\n'), 1) << o.log;
}

// A copy of the room's recording to spoil; images are shared.
Path copy_of_room(const std::string& name) {
  const Path folder = scratch() / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  for (const char* file : {"calibration.yaml", "depth.txt", "scans.csv", "odometry.txt"}) {
    std::filesystem::copy_file(room(1) / file, folder / file);
  }
  std::filesystem::create_directory_symlink(room(1) / "depth", folder / "depth");
  return folder;
}

void replace_in(const Path& file, const std::string& what, const std::string& with) {
  std::string text = text_of(file);
  const auto at = text.find(what);
  ASSERT_NE(at, std::string::npos);
  std::ofstream(file) << text.replace(at, what.size(), with);
}

TEST(Contract, EveryVerbHasHelpWithAnExample) {
  const Outcome all = outcome({"--help"});
  EXPECT_EQ(all.code, 0);
  for (const char* verb : {"map", "refine", "scan", "plan", "simulate", "evaluate", "info", "view",
                           "export", "config"}) {
    EXPECT_THAT(all.out, HasSubstr(verb));
    const Outcome one = outcome({verb, "--help"});
    EXPECT_EQ(one.code, 0) << verb;
    EXPECT_THAT(one.out, HasSubstr("Example:\n  lamina " + std::string(verb))) << verb;
  }
}

TEST(Contract, SaysItsVersion) {
  const Outcome o = outcome({"--version"});
  EXPECT_EQ(o.code, 0);
  EXPECT_THAT(o.out, testing::MatchesRegex("lamina [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(Contract, WrongUsageIsOneLineAndExitTwo) {
  const std::string map = mapped(1), data = room(1), out = scratch() / "none";
  expect_usage({}, "a verb is missing");
  expect_usage({"mpa", data}, "unknown verb 'mpa': did you mean 'map'?");
  expect_usage({"map"}, "map: INPUT is missing; e.g. lamina map");
  expect_usage({"map", data, "--outptu", out},
               "unknown option '--outptu': did you mean '--output'?");
  expect_usage({"map", "nothing", "--output", out}, "found no such file or folder");
  expect_usage({"map", data, "--output", out, "--mode", "fast"},
               "map: --mode 'fast': expected offline or online");
  expect_usage({"map", data}, "map: --output DIR is missing; e.g. lamina map recording.log");
  expect_usage({"map", data, data, "--output", out},
               "map: one INPUT only, found a second: " + data);
  expect_usage({"map", data, "--output", out, "--set", "window.keyframe=9"},
               "did you mean 'window.keyframes'?");
  expect_usage({"map", data, "--output", out, "--set", "window.keyframes=many"},
               "found 'many', expected a whole number");
  expect_usage({"map", data, "--output", out, "--preset", "indoor"}, "expected auto, indoor_rgbd");
  expect_usage({"simulate", "rom", "--output", out}, "unknown scene 'rom': did you mean 'room'?");
  expect_usage({"plan", map, "--from", "0", "--to", "1,1"}, "expected X,Y");
  expect_usage({"view", "nothing"},
               "nothing: found no such folder, expected a map's output folder");
  expect_usage({"view", "nothing", "--truth", data}, "nothing: found no such folder");
  expect_usage({"view", data}, "found a recording (calibration.yaml) and no map of it, expected");
  expect_usage({"view", Path(map) / "planes.json"}, "planes.json: found a file, expected");
  expect_usage({"view", scratch()}, "found neither planes.json nor trajectory.txt, expected");
  expect_usage({"export", map, "--to", "pdf"}, "--to: found 'pdf', expected one of: keepout");
  expect_usage({"export", "nothing", "--to", "keepout", "--output", out}, "found no such folder");
  expect_usage({"plan", "nothing", "--from", "0,0", "--to", "1,1"}, "found no such folder");
  expect_usage({"evaluate", "nothing", "--truth", data}, "found no such folder");
  expect_usage({"refine", "nothing", "--output", out}, "session.lamina");
  expect_usage({"evaluate", map, "--truth", "nothing"}, "does not exist");
  expect_usage({"evaluate", map}, "--truth DATASET or --relations FILE is missing");
  EXPECT_FALSE(std::filesystem::exists(out)) << "nothing is written where usage is at fault";
}

// What a verb would not heed it does not take.
TEST(Contract, OptionsWithoutEffectAreRefused) {
  const std::string map = mapped(1), data = room(1), out = scratch() / "none";
  expect_usage({"refine", map, "--output", out, "--mode", "online"},
               "--mode: found 'online' for " + map + ", expected offline");
  expect_usage({"refine", map, "--output", out, "--keyframes", "9"}, "--keyframes: found");
  expect_usage({"refine", "x.planegraph", "--output", out, "--keyframes", "9"},
               "--keyframes: found");
  expect_usage({"scan", data, "--output", out, "--set", "grid.resolution_m=0.1"},
               "--set: found 'grid.resolution_m=0.1', which changes no scan");
  expect_usage({"scan", data, "--output", out, "--set", "topics.depth=/none", "--set", "seed=3"},
               "found 'seed=3'");
  expect_usage({"simulate", "room", "--list"}, "SCENE excludes --list");
  expect_usage({"simulate", "--list", "--output", out}, "--output excludes --list");
  expect_usage({"config", "--markdown", "--defaults"}, "--defaults excludes --markdown");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(Contract, WrongConfigurationNamesFileAndLine) {
  const Path config = scratch() / "wrong.yaml";
  std::ofstream(config) << "window:\n  keyframes: 20\n  keyfrmes: 3\n";
  expect_usage({"map", room(1), "--output", scratch() / "none", "--config", config},
               config.string() + ":3: unknown key 'window.keyfrmes'");
}

TEST(Contract, WrongCalibrationNamesFileLineAndKey) {
  const Path folder = copy_of_room("wrong_calibration");
  replace_in(folder / "calibration.yaml", "fx: 525", "fx: abc");
  expect_usage({"map", folder, "--output", scratch() / "none"},
               "calibration.yaml:6: depth_camera.fx: found 'abc'");
}

TEST(Contract, WhatHasNothingToCompareOrConvertIsAnError) {
  const Path empty = scratch() / "empty";
  std::filesystem::create_directories(empty);
  expect_usage({"evaluate", mapped(1), "--truth", empty}, "found neither groundtruth.txt");
  const Path scans = copy_of_room("scans_only");
  std::filesystem::remove(scans / "depth.txt");
  expect_usage({"scan", scans, "--output", scratch() / "scans.csv"}, "found no depth image");
  EXPECT_FALSE(std::filesystem::exists(scratch() / "scans.csv"));
}

TEST(Contract, AccuracyLimitsDecideTheExitCode) {
  EXPECT_EQ(outcome({"evaluate", mapped(1), "--truth", room(1), "--max-ate", "0.05"}).code, 0);
  const Outcome o = outcome({"evaluate", mapped(1), "--truth", room(1), "--max-ate", "1e-6"});
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.log, HasSubstr("expected at most"));
  EXPECT_TRUE(nlohmann::json::parse(text_of(mapped(1) / "evaluation.json")).contains("trajectory"));
}

TEST(Contract, AMapHasItsFilesAndKeys) {
  const Path map = mapped(1);
  for (const char* file :
       {"trajectory.txt", "planes.json", "planes.ply", "surfels.ply", "grid/grid.yaml",
        "grid/height.tiff", "grid/slope.tiff", "grid/navigability.tiff", "grid/confidence.tiff",
        "map.yaml", "map.png", "occupancy.yaml", "occupancy.pgm", "scans.csv", "graph.g2o",
        "session.lamina", "metrics.json", "config.yaml", "report.html"}) {
    EXPECT_GT(std::filesystem::file_size(map / file), 0u) << file;
  }
  EXPECT_FALSE(std::filesystem::exists(map / ".checkpoint"));
  const auto metrics = nlohmann::json::parse(text_of(map / "metrics.json"));
  for (const char* stage : {"decode", "odometry", "floor", "obstacles", "segments", "associate",
                            "window", "raster", "write"}) {
    for (const char* key : {"calls", "median_ms", "p95_ms", "p99_ms", "max_ms"}) {
      EXPECT_TRUE(metrics["stages"][stage].contains(key)) << stage << " " << key;
    }
  }
  EXPECT_TRUE(metrics["refine"].contains("solve_s"));
  EXPECT_TRUE(metrics["refine"].contains("iterations"));
  EXPECT_EQ(metrics["refine"]["status"], "converged");
  EXPECT_GT(metrics["peak_rss_mb"], 1);
  EXPECT_GT(metrics["total_s"], 0);
  for (const char* text : {"input", "version", "command"}) {
    EXPECT_FALSE(metrics[text].get<std::string>().empty()) << text;
  }
  EXPECT_TRUE(metrics.contains("skipped"));
  const auto planes = nlohmann::json::parse(text_of(map / "planes.json"))["planes"];
  ASSERT_GT(planes.size(), 3u);
  for (const char* key :
       {"id", "label", "normal", "rho", "theta", "phi", "sigma_rho", "sigma_angle", "boundary",
        "area", "observations", "first_seen", "last_seen"}) {
    EXPECT_TRUE(planes[0].contains(key)) << key;
  }
  EXPECT_THAT(text_of(map / "config.yaml"), HasSubstr("preset: wheeled_lidar"));
  EXPECT_THAT(text_of(map / "graph.g2o"), HasSubstr("EDGE_SE3:QUAT"));
  EXPECT_THAT(text_of(map / "graph.g2o"), HasSubstr("VERTEX_PLANE"));
}

TEST(Contract, ThereIsAPoseForEveryFrameAndScanAndTheFirstIsTheOdometrys) {
  const Trajectory path = Trajectory::read_tum(mapped(1) / "trajectory.txt");
  const Trajectory odometry = Trajectory::read_tum(room(1) / "odometry.txt");
  const SE3 off = odometry.at(path.front().stamp)->inverse() * path.front().pose;
  EXPECT_LT(off.log().norm(), 1e-5);
  std::set<Timestamp> stamps;
  for (const StampedPose& p : path) stamps.insert(p.stamp);
  for (const char* list : {"depth.txt", "scans.csv"}) {
    std::ifstream in(room(1) / list);
    for (std::string line; std::getline(in, line);) {
      if (line.empty() || line[0] == '#') continue;
      const auto stamp = Timestamp::parse(line.substr(0, line.find_first_of(" ,")));
      ASSERT_TRUE(stamp);
      EXPECT_EQ(stamps.count(*stamp), 1u) << list << " " << line.substr(0, 20);
    }
  }
}

// Drivers start in any order: scans and images of the first second find no odometry yet.
TEST(Contract, TheFirstPoseIsTheOdometrysWhereThatBeginsASecondLate) {
  const Path folder = copy_of_room("late_odometry");
  const Trajectory odometry = Trajectory::read_tum(room(1) / "odometry.txt");
  const Timestamp late = Timestamp::from_seconds(odometry.front().stamp.seconds() + 1);
  std::ofstream out(folder / "odometry.txt");
  std::ifstream in(room(1) / "odometry.txt");
  for (std::string line; std::getline(in, line);) {
    if (line[0] != '#' && std::stod(line) >= late.seconds()) out << line << '\n';
  }
  out.close();
  const SE3 first = Trajectory::read_tum(folder / "odometry.txt").front().pose;
  ASSERT_GT(first.log().norm(), 0.1);  // it has driven by then
  const Path map = scratch() / "map_late_odometry";
  ASSERT_EQ(outcome({"map", folder, "--output", map, "--quiet"}).code, 0);
  const Trajectory path = Trajectory::read_tum(map / "trajectory.txt");
  EXPECT_LT(path.front().stamp, late);
  // Odometry is carried on by an interval before its first sample.
  EXPECT_LT((first.inverse() * path.front().pose).log().norm(), 0.04);
}

TEST(Contract, OdometryWhoseStampsNeverMeetIsSaidAndTheRestMaps) {
  const Path folder = copy_of_room("other_clock");
  std::ifstream in(room(1) / "odometry.txt");
  std::ofstream out(folder / "odometry.txt");
  for (std::string line; std::getline(in, line);) {
    if (line[0] == '#') continue;
    out << std::stod(line) - 500 << line.substr(line.find(' ')) << '\n';
  }
  out.close();
  const Outcome o = outcome({"map", folder, "--output", scratch() / "map_clock", "--quiet"});
  EXPECT_EQ(o.code, 0);
  EXPECT_THAT(o.log, HasSubstr("the odometry's stamps never meet those of frames and scans"));
}

// Logs without odometry often hold one of zeros.
TEST(Contract, OdometryThatNeverMovesIsSaidAndNotUsed) {
  const Path folder = copy_of_room("no_counter");
  std::ifstream in(room(1) / "odometry.txt");
  std::ofstream out(folder / "odometry.txt");
  for (std::string line; std::getline(in, line);) {
    if (line[0] != '#') out << line.substr(0, line.find(' ')) << " 0 0 0 0 0 0 1\n";
  }
  out.close();
  const Path map = scratch() / "map_no_counter";
  const Outcome o = outcome({"map", folder, "--output", map, "--quiet"});
  EXPECT_EQ(o.code, 0);
  EXPECT_THAT(o.log, HasSubstr("the odometry holds one pose from first to last"));
  EXPECT_EQ(outcome({"evaluate", map, "--truth", room(1), "--max-ate", "0.03"}).code, 0);
}

// Ctrl-C while it reads: the frame is finished, all is written, what is left can be gone on with.
TEST(Contract, InterruptedRunsWriteEverything) {
  const Path map = scratch() / "interrupted", log = scratch() / "interrupted.log";
  const pid_t child = start(
      {"map", room(1), "--output", map, "--mode", "online", "--set", "checkpoint.interval_s=0.05"},
      log);
  await(map / ".checkpoint" / "state");
  ::kill(child, SIGINT);
  EXPECT_EQ(wait_for(child), 0) << text_of(log);
  EXPECT_TRUE(std::filesystem::exists(map / "report.html"));
  EXPECT_TRUE(std::filesystem::exists(map / "trajectory.txt"));
}

// A recording played as a device, at its own pace, until Ctrl-C: later where a slow build has not
// seen frames enough for a plane by then.
TEST(Contract, ADeviceIsMappedUntilCtrlC) {
  const Path oni = Path(LAMINA_SOURCE_DIR) / "../shared/data/openni_kinect/recording.oni";
  if (!std::filesystem::exists(oni)) GTEST_SKIP() << oni << " is not there";
  const Path map = scratch() / "live", log = scratch() / "live.log";
  int code = -1;
  for (const unsigned seconds : {3U, 15U, 60U}) {
    const pid_t child = start({"map", "openni:" + oni.string(), "--output", map}, log);
    ::sleep(seconds);
    ::kill(child, SIGINT);
    code = wait_for(child);
    if (text_of(log).find("found no plane in") == std::string::npos) break;
  }
  EXPECT_EQ(code, 0) << text_of(log);
  EXPECT_GE(Trajectory::read_tum(map / "trajectory.txt").size(), 1u);
  EXPECT_FALSE(std::filesystem::exists(map / ".checkpoint"));
}

// Unorganised clouds of a corner of a room, the sensor moving 2 cm a cloud.
TEST(Contract, AFolderOfCloudsIsMapped) {
  const Path folder = scratch() / "clouds", map = scratch() / "map_clouds";
  std::filesystem::create_directories(folder);
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, 0.003);
  for (int k = 0; k < 12; ++k) {
    const double x = 0.02 * k;  // sensor at (x, 0, 1), axes as the room's
    std::stringstream points;
    int count = 0;
    for (int i = 0; i < 9000; ++i) {
      const double a = unit(engine), b = unit(engine), e = noise(engine);
      Eigen::Vector3d p;
      if (i % 3 == 0) p = {0.5 + 3.5 * a, -2 + 4 * b, e};
      if (i % 3 == 1) p = {4 + e, -2 + 4 * a, 2 * b};
      if (i % 3 == 2) p = {0.5 + 3.5 * a, 2 + e, 2 * b};
      points << p.x() - x << ' ' << p.y() << ' ' << p.z() - 1 << '\n';
      ++count;
    }
    std::ofstream out(folder /
                      ("100" + std::to_string(k / 10) + "." + std::to_string(k % 10) + ".pcd"));
    out << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << count
        << "\nHEIGHT 1\nVIEWPOINT 0 0 1 1 0 0 0\nPOINTS " << count << "\nDATA ascii\n"
        << points.str();
  }
  const Outcome o = outcome({"map", folder, "--output", map, "--quiet"});
  ASSERT_EQ(o.code, 0) << o.log;
  const auto planes = nlohmann::json::parse(text_of(map / "planes.json"))["planes"];
  std::map<std::string, int> labels;
  for (const auto& plane : planes) ++labels[plane["label"].get<std::string>()];
  EXPECT_EQ(labels["floor"], 1);
  EXPECT_GE(labels["wall"], 2);
  EXPECT_EQ(Trajectory::read_tum(map / "trajectory.txt").size(), 12u);
}

TEST(Contract, AMapIsExportedWhereItIsAndElsewhere) {
  const Path map = mapped(1), elsewhere = scratch() / "masks" / "deep";
  const Outcome there = outcome({"export", map, "--to", "keepout", "--output", elsewhere});
  ASSERT_EQ(there.code, 0) << there.log;
  for (const char* name : {"keepout.yaml", "keepout.pgm", "speed.yaml", "speed.pgm"}) {
    EXPECT_THAT(there.out, HasSubstr((elsewhere / name).string() + "\n"));
    EXPECT_TRUE(std::filesystem::exists(elsewhere / name)) << name;
    EXPECT_FALSE(std::filesystem::exists(map / name)) << name;
  }
  const std::string pixels = text_of(elsewhere / "keepout.pgm");
  EXPECT_GT(std::count(pixels.begin(), pixels.end(), static_cast<char>(100)), 50) << "walls";
}

// Looking up it sees none, whatever its mounting says; nobody knows where the floor is. Nothing is
// free then, here and where the session goes on.
TEST(Contract, ACameraThatNeverShowsFloorMakesNoFreeGround) {
  const Path data = scratch() / "looks_up", map = scratch() / "map_looks_up";
  const Path again = scratch() / "again_looks_up";
  ASSERT_EQ(
      outcome({"simulate", "room", "--output", data, "--duration", "6", "--quiet", "--set",
               "camera.pitch_deg=-20", "--set", "lidar.enabled=false", "--set", "camera.rate_hz=3"})
          .code,
      0);
  const Outcome mapped = outcome({"map", data, "--output", map, "--quiet"});
  ASSERT_EQ(mapped.code, 0) << mapped.log;
  EXPECT_THAT(mapped.log, HasSubstr("no ground is free by this camera"));
  ASSERT_EQ(outcome({"refine", map, "--output", again, "--quiet"}).code, 0);
  for (const Path& folder : {map, again}) {
    const std::string pixels = text_of(folder / "occupancy.pgm");
    EXPECT_EQ(std::count(pixels.begin(), pixels.end(), '\xfe'), 0) << folder;
    const Outcome plan = outcome({"plan", folder, "--from", "0,0", "--to", "0.5,0"});
    EXPECT_NE(plan.code, 0) << plan.out;
  }
}

}  // namespace
}  // namespace lamina
