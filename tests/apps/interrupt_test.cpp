// Signals at any instant: the program is gone within a second, what it leaves can be used, and
// --resume ends where a run that nobody interrupted does.
#include <gmock/gmock.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <random>

#include <lamina/models/trajectory.hpp>

#include "program.hpp"

namespace lamina {
namespace {

using namespace program;
using Clock = std::chrono::steady_clock;
using testing::HasSubstr;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// The bar is a second; a machine that does much else may come late to a timer.
constexpr double kBar = 1, kLate = 6;  // s

struct Ended {
  int code = 0;
  bool by_signal = false;  // it had not ended before
  double took = 0;         // s from the signal to the end
};

Ended interrupt(pid_t child, double after, int signal) {
  ::usleep(static_cast<useconds_t>(1e6 * after));
  const bool running = ::kill(child, 0) == 0 && ::waitpid(child, nullptr, WNOHANG | WNOWAIT) == 0;
  const auto begin = Clock::now();
  ::kill(child, signal);
  Ended ended;
  ended.code = wait_for(child);
  ended.took = seconds_since(begin);
  ended.by_signal = running;
  return ended;
}

std::vector<std::string> map_command(const Path& map, const std::string& mode) {
  return {"map",     room(1),  "--output",
          map,       "--mode", mode,
          "--quiet", "--set",  "checkpoint.interval_s=0.2"};
}

// Every file of an interrupted map is whole.
void expect_usable(const Path& map) {
  if (std::filesystem::exists(map / "trajectory.txt")) {
    EXPECT_GE(Trajectory::read_tum(map / "trajectory.txt").size(), 1u);
  }
  for (const char* file : {"planes.json", "metrics.json"}) {
    if (std::filesystem::exists(map / file)) {
      EXPECT_TRUE(nlohmann::json::accept(text_of(map / file))) << file;
    }
  }
}

void expect_same(const Path& a, const Path& b) {
  for (const char* file :
       {"trajectory.txt", "planes.json", "grid/height.tiff", "grid/navigability.tiff"}) {
    EXPECT_EQ(text_of(a / file), text_of(b / file)) << file;
  }
}

void interrupt_at_random(const std::string& mode, unsigned seed, int times) {
  const Path whole = scratch() / ("whole_" + mode), map = scratch() / ("cut_" + mode);
  const Path log = scratch() / ("cut_" + mode + ".log");
  const auto begin = Clock::now();
  ASSERT_EQ(run(map_command(whole, mode)), 0);
  const double all = seconds_since(begin);
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> share(0.05, 1);
  for (int k = 0; k < times; ++k) {
    std::filesystem::remove_all(map);
    const double after = all * share(engine);
    SCOPED_TRACE(after);
    const Ended ended =
        interrupt(start(map_command(map, mode), log), after, k % 2 == 0 ? SIGTERM : SIGINT);
    EXPECT_LT(ended.took, kBar + kLate);
    expect_usable(map);
    if (ended.by_signal && ended.code == 0 && std::filesystem::exists(map / ".checkpoint")) {
      EXPECT_THAT(text_of(log), HasSubstr("the map is partial"));
    }
    auto again = map_command(map, mode);
    again.push_back("--resume");
    ASSERT_EQ(run(again, log), 0) << text_of(log);
    expect_same(whole, map);
    EXPECT_FALSE(std::filesystem::exists(map / ".checkpoint"));
  }
}

TEST(Interrupt, AMapAtAnyInstant) { interrupt_at_random("offline", 1, 5); }

TEST(Interrupt, AnOnlineMapAtAnyInstant) { interrupt_at_random("online", 2, 3); }

TEST(Interrupt, ScansThatWereMadeAreKept) {
  const Path file = scratch() / "cut.csv", log = scratch() / "scan.log";
  const Ended ended = interrupt(start({"scan", room(1), "--output", file}, log), 0.6, SIGTERM);
  EXPECT_LT(ended.took, kBar + kLate);
  if (ended.code == 0) {
    EXPECT_THAT(text_of(file), HasSubstr("timestamp"));
  }
  // On a slow machine the signal may come before the program has begun, which leaves no word.
  if (ended.code != 0 && !text_of(log).empty()) {
    EXPECT_THAT(text_of(log), HasSubstr("nothing was written"));
  }
}

TEST(Interrupt, RefinementEnds) {
  const Path out = scratch() / "refined", log = scratch() / "refine.log";
  const Ended ended = interrupt(start({"refine", mapped(1), "--output", out}, log), 0.3, SIGTERM);
  EXPECT_LT(ended.took, kBar + kLate);
  expect_usable(out);
}

TEST(Interrupt, ASimulatedRecordingEndsEarly) {
  const Path folder = scratch() / "cut_room", log = scratch() / "simulate.log";
  const Ended ended = interrupt(start({"simulate", "room", "--output", folder}, log), 0.8, SIGINT);
  EXPECT_LT(ended.took, kBar + kLate);
  if (ended.code == 0) {
    EXPECT_EQ(run({"info", folder}), 0);
  }
}

TEST(Interrupt, ASecondSignalEndsAtOnce) {
  const pid_t child = start(map_command(scratch() / "twice", "offline"));
  ::usleep(500000);
  ::kill(child, SIGTERM);
  ::kill(child, SIGINT);
  const auto begin = Clock::now();
  wait_for(child);
  EXPECT_LT(seconds_since(begin), kBar + kLate);
}

}  // namespace
}  // namespace lamina
