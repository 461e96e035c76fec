// What careless and hostile users hand the program: one line that says where and what, the exit
// code of the contract, and nothing lost.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>

#include "apps/program.hpp"

namespace lamina {
namespace {

using namespace program;
using testing::HasSubstr;

// Exit 2 and one line that holds these words.
void expect_refused(const std::vector<std::string>& arguments, const std::string& words) {
  const Path log = scratch() / "bad.log";
  EXPECT_EQ(run(arguments, log), 2) << words;
  const std::string said = text_of(log);
  EXPECT_THAT(said, HasSubstr(words));
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
}

// The room's calibration and these of its files.
Path part_of_room(const std::string& name, const std::vector<std::string>& files) {
  const Path folder = scratch() / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(room(1) / "calibration.yaml", folder / "calibration.yaml");
  for (const auto& file : files) std::filesystem::copy_file(room(1) / file, folder / file);
  std::filesystem::create_directory_symlink(room(1) / "depth", folder / "depth");
  return folder;
}

std::vector<std::string> map_to(const Path& input, const Path& output) {
  return {"map", input, "--output", output, "--quiet"};
}

TEST(BadInput, SettingsThatCannotWorkAreRefusedBeforeTheRun) {
  const Path out = scratch() / "nothing";
  auto arguments = map_to(room(1), out);
  arguments.insert(arguments.end(), {"--set", "grid.resolution_m=20"});
  expect_refused(arguments, "grid.resolution_m: found '20', expected a number from 0.005 to 10");
  const Path config = scratch() / "twice.yaml";
  std::ofstream(config) << "seed: 1\nthreads: 1\nseed: 2\n";
  arguments = map_to(room(1), out);
  arguments.insert(arguments.end(), {"--config", config});
  expect_refused(arguments, config.string() + ":3: found the key 'seed' a second time");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(BadInput, NumbersBeyondAllUseAreRefused) {
  const Path map = mapped(1);
  expect_refused({"plan", map, "--from", "1e300,0", "--to", "0,0"}, "--from: found '1e300,0'");
  expect_refused({"plan", map, "--from", "0,0", "--to", "0,-2e6"}, "within 1000 km");
  expect_refused({"evaluate", map, "--truth", room(1), "--max-ate", "nan"}, "--max-ate");
  expect_refused({"evaluate", map, "--truth", room(1), "--max-missed", "-1"}, "--max-missed");
  for (const char* duration : {"-1", "nan", "inf"}) {
    expect_refused({"simulate", "room", "--output", scratch() / "s", "--duration", duration},
                   "--duration: found");
  }
}

TEST(BadInput, TheRecordingIsNotWrittenOver) {
  const Path data = part_of_room("own_folder", {"scans.csv", "odometry.txt", "depth.txt"});
  const std::string before = text_of(data / "scans.csv");
  expect_refused(map_to(data, data), "found a recording there (calibration.yaml)");
  expect_refused({"refine", mapped(1), "--output", data}, "found a recording there");
  for (const char* file : {"scans.csv", "depth.txt"}) {
    expect_refused({"scan", data, "--output", data / file}, "found a file of a recording");
  }
  expect_refused({"scan", data, "--output", scratch()}, "found a folder");
  std::ofstream(data / "calibration.yaml") << "odometry:\n  planar: true\n";  // nobody's scene
  expect_refused({"simulate", "room", "--output", data},
                 "found a recording that was not simulated");
  EXPECT_EQ(text_of(data / "scans.csv"), before);
}

TEST(BadInput, WhatIsOfAnotherMapGoes) {
  const Path out = scratch() / "map_again";
  std::filesystem::remove_all(out);
  std::filesystem::create_directories(out);
  const std::vector<std::string> stale{"path.csv",         "path.png",        "trajectory_1.txt",
                                       "trajectory_2.txt", "evaluation.json", "keepout.pgm"};
  for (const std::string& file : stale) std::ofstream(out / file) << "old\n";
  ASSERT_EQ(run({"refine", mapped(1), "--output", out, "--quiet"}), 0);
  for (const std::string& file : stale) EXPECT_FALSE(std::filesystem::exists(out / file)) << file;
}

TEST(BadInput, NothingMappedIsOneLineWithTheCause) {
  const Path data = part_of_room("no_return", {"scans.csv"}), out = scratch() / "map_no_return";
  std::ofstream(data / "scans.csv") << "1000,-1,0.1,0.1,30,0,0,0\n1001,-1,0.1,0.1,30,0,0,0\n"
                                    << "1002,-1,0.1,0.1,30,0,0,0\n";
  expect_refused(map_to(data, out), "3 scan: scan without returns; nothing measured the motion");
}

TEST(BadInput, ScansOfOneStampAreReadInTheOrderOfTheirLines) {
  const Path data = part_of_room("one_stamp", {"scans.csv"}), out = scratch() / "map_one_stamp";
  std::string text;
  std::ifstream in(room(1) / "scans.csv");
  for (std::string line; std::getline(in, line);) {
    if (line[0] != '#') text += "1000" + line.substr(line.find(',')) + "\n";
  }
  std::ofstream(data / "scans.csv") << text;
  const Path log = scratch() / "one_stamp.log";
  EXPECT_EQ(run(map_to(data, out), log), 0) << text_of(log);
  EXPECT_NE(text_of(log).find("stamps of scans cannot order them"), std::string::npos);
}

TEST(BadInput, ImagesOfAnotherCameraSayBothSizes) {
  const Path data = part_of_room("other_camera", {"depth.txt"});
  std::string text = text_of(data / "calibration.yaml");
  text.replace(text.find("width: 640"), 10, "width: 320");
  std::ofstream(data / "calibration.yaml") << text;
  expect_refused(map_to(data, scratch() / "map_other_camera"),
                 "640 x 480, 16 bit grey, calibration.yaml has 320 x 480");
}

TEST(BadInput, ACheckpointOfARecordingThatHasChangedIsRefused) {
  const Path data = part_of_room("grows", {"scans.csv"}), out = scratch() / "map_grows";
  auto arguments = map_to(data, out);
  arguments.insert(arguments.end(), {"--set", "checkpoint.interval_s=0.001"});
  const pid_t child = start(arguments);
  await(out / ".checkpoint" / "state");
  ::kill(child, SIGKILL);
  wait_for(child);
  ASSERT_TRUE(std::filesystem::exists(out / ".checkpoint" / "state"));
  std::ofstream(data / "scans.csv", std::ios::app) << "2000,-1,0.1,0.1,30,1,1,1\n";
  arguments.emplace_back("--resume");
  expect_refused(arguments, "found a checkpoint of another run (recording: ");
}

// A disk that holds no file above 100 kB: what was written stays, and the line names the file.
TEST(BadInput, AFullDiskIsSaidAndLeavesWhatWasThere) {
  const Path out = scratch() / "full", log = scratch() / "full.log";
  const rlimit unlimited{RLIM_INFINITY, RLIM_INFINITY};
  rlimit before = unlimited;
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const Path data = part_of_room("for_full", {"scans.csv", "odometry.txt"});
  ASSERT_EQ(run(map_to(data, out)), 0);
  const std::string session = text_of(out / "session.lamina");
  ASSERT_GT(session.size(), 100'000u);
  const rlimit small{100'000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const pid_t child = start(map_to(data, out), log);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_EQ(wait_for(child), 2);
  EXPECT_THAT(text_of(log), HasSubstr("writing failed, is the disk full?"));
  EXPECT_EQ(text_of(out / "session.lamina"), session);
  for (const auto& entry : std::filesystem::directory_iterator(out)) {
    EXPECT_NE(entry.path().extension(), ".part") << entry.path();
  }
}

// What a verb prints is its result: /dev/full takes none of it.
TEST(BadInput, PrintingToAFullDiskIsAnError) {
  const Path log = scratch() / "full_out.log";
  EXPECT_EQ(run({"config"}, log, "/dev/full"), 2);
  EXPECT_THAT(text_of(log), HasSubstr("standard output: found that it cannot be written"));
}

}  // namespace
}  // namespace lamina
