// Signals at any instant: the program is gone within a second, what it leaves can be used, and
// --resume ends where a run that nobody interrupted does.
#include <gmock/gmock.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include <lamina/models/trajectory.hpp>

#include "apps/program.hpp"

namespace lamina {
namespace {

using namespace program;
using Clock = std::chrono::steady_clock;
using testing::HasSubstr;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// The bar is a second of work, whatever else the machine does; sanitizers work more slowly.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kBar = 8;
#else
constexpr double kBar = 1;
#endif
constexpr double kWall = 7 * kBar;  // s

// s of work so far, or none where it has ended.
std::optional<double> work_of(pid_t child) {
  std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
  std::string field;
  double ticks = 0;
  for (int i = 1; i <= 15 && stat >> field; ++i) {
    if (i == 3 && field == "Z") return std::nullopt;
    if (i >= 14) ticks += std::stod(field);
  }
  if (!stat) return std::nullopt;
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

struct Ended {
  int code = 0;
  bool by_signal = false;  // it had not ended before
  double work = 0;         // s from its beginning to the end
  double after = 0;        // of these, from the signal on
};

Ended end_of(pid_t child) {
  int status = 0;
  rusage used{};
  ::wait4(child, &status, 0, &used);
  Ended ended;
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  for (const timeval& t : {used.ru_utime, used.ru_stime})
    ended.work += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  return ended;
}

// `after`: s of work.
Ended interrupt(pid_t child, double after, int signal) {
  std::optional<double> work = 0;
  while ((work = work_of(child)) && *work < after) ::usleep(1000);
  const auto begin = Clock::now();
  ::kill(child, signal);
  Ended ended = end_of(child);
  ended.by_signal = work.has_value();
  ended.after = work ? ended.work - *work : 0;
  EXPECT_LT(ended.after, kBar);
  EXPECT_LT(seconds_since(begin), kWall);
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
  const Ended all = end_of(start(map_command(whole, mode)));
  ASSERT_EQ(all.code, 0);
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> share(0.05, 1);
  for (int k = 0; k < times; ++k) {
    std::filesystem::remove_all(map);
    const double after = all.work * share(engine);
    SCOPED_TRACE(after);
    const Ended ended =
        interrupt(start(map_command(map, mode), log), after, k % 2 == 0 ? SIGTERM : SIGINT);
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
  if (ended.code == 0) {
    EXPECT_THAT(text_of(file), HasSubstr("timestamp"));
  }
  if (ended.code != 0) {
    EXPECT_THAT(text_of(log), HasSubstr("nothing was written"));
  }
}

TEST(Interrupt, RefinementEnds) {
  const Path out = scratch() / "refined", log = scratch() / "refine.log";
  interrupt(start({"refine", mapped(1), "--output", out}, log), 0.3, SIGTERM);
  expect_usable(out);
}

TEST(Interrupt, ASimulatedRecordingEndsEarly) {
  const Path folder = scratch() / "cut_room", log = scratch() / "simulate.log";
  const Ended ended = interrupt(start({"simulate", "room", "--output", folder}, log), 0.8, SIGINT);
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
  EXPECT_LT(seconds_since(begin), kWall);
}

}  // namespace
}  // namespace lamina
