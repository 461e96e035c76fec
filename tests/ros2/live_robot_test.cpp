// A robot of another vendor's DDS is mapped as its recording is, and receives the map.
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/live_source.hpp>

#include "apps/program.hpp"
#include "ros2/recorded_robot.hpp"

namespace lamina::test {
namespace {

using program::Path;
using program::scratch;

// Domains of tests that run at once differ.
int own_domain() { return 20 + static_cast<int>(::getpid() % 80); }

Path recorded(const std::string& scene, const std::string& duration) {
  const Path folder = scratch() / (scene + duration);
  if (!std::filesystem::exists(folder / "recording")) {
    EXPECT_EQ(program::run({"simulate", scene, "--output", folder, "--duration", duration,
                            "--format", "mcap", "--quiet"}),
              0);
  }
  return folder;
}

nlohmann::json json_of(const Path& file) { return nlohmann::json::parse(program::text_of(file)); }

double position_error(const Path& map, const Path& truth) {
  EXPECT_EQ(program::run({"evaluate", map, "--truth", truth}), 0);
  return json_of(map / "evaluation.json")["trajectory"]["ate_m"]["rmse"].get<double>();
}

// Messages that did not reach the mapper, by its own count.
std::int64_t missed(const nlohmann::json& metrics) {
  std::int64_t sum = 0;
  for (const auto& [why, count] : metrics["skipped"].items())
    if (why.rfind("dropped", 0) == 0 || why.rfind("lost on the way", 0) == 0)
      sum += count.get<std::int64_t>();
  return sum;
}

// nav_msgs/OccupancyGrid and tf2_msgs/TFMessage, read by Fast CDR alone.
struct Grid {
  float resolution = 0;
  std::uint32_t width = 0, height = 0;
  double x = 0, y = 0;
  std::vector<std::int8_t> cells;
};

struct Reader {
  explicit Reader(std::string message)
      : bytes(std::move(message)),
        buffer(bytes.data(), bytes.size()),
        cdr(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR) {
    cdr.read_encapsulation();
  }
  std::int64_t stamp() {
    std::int32_t seconds = 0;
    std::uint32_t rest = 0;
    cdr >> seconds >> rest;
    return std::int64_t{1000000000} * seconds + rest;
  }
  std::string bytes;
  eprosima::fastcdr::FastBuffer buffer;
  eprosima::fastcdr::Cdr cdr;
};

Grid grid_of(const std::string& message) {
  Reader in(message);
  Grid grid;
  std::string frame;
  in.stamp();
  in.cdr >> frame;
  EXPECT_EQ(frame, "map");
  in.stamp();
  double rest = 0;
  in.cdr >> grid.resolution >> grid.width >> grid.height >> grid.x >> grid.y;
  for (int i = 0; i < 5; ++i) in.cdr >> rest;
  in.cdr >> grid.cells;
  return grid;
}

// What a subscriber of the robot's network receives of the map.
class Onlooker {
 public:
  explicit Onlooker(int domain) : node_(domain) {
    node_.subscribe("/map", "nav_msgs/msg/OccupancyGrid", {true, true, 1},
                    [this](const std::string& bytes) {
                      const std::lock_guard lock(mutex_);
                      map_ = bytes;
                      ++maps_;
                    });
    node_.subscribe("/tf", "tf2_msgs/msg/TFMessage", {true, false, 100},
                    [this](const std::string& bytes) { note_transform(bytes); });
  }
  int maps() const {
    const std::lock_guard lock(mutex_);
    return maps_;
  }
  Grid grid() const {
    const std::lock_guard lock(mutex_);
    return grid_of(map_);
  }
  /// When map -> odom came, by the stamp of its scan.
  std::map<std::int64_t, Clock::time_point> transforms() const {
    const std::lock_guard lock(mutex_);
    return transforms_;
  }

 private:
  void note_transform(const std::string& bytes) {
    constexpr std::int64_t kAhead = 200000000;  // ns that the transform is stamped ahead
    const auto now = Clock::now();
    Reader in(bytes);
    std::uint32_t count = 0;
    in.cdr >> count;
    const std::int64_t stamp = in.stamp() - kAhead;
    std::string frame, child;
    in.cdr >> frame >> child;
    const std::lock_guard lock(mutex_);
    if (frame == "map" && child == "odom") transforms_.emplace(stamp, now);
  }

  mutable std::mutex mutex_;
  std::string map_;
  int maps_ = 0;
  std::map<std::int64_t, Clock::time_point> transforms_;
  FastRobot node_;
};

// ms, of scans that were published once the first look was over and mapped.
void print_latency(const RecordedRobot& robot, const Onlooker& onlooker) {
  constexpr double kCaughtUp = 4;  // s from the first scan: the look and what was kept meanwhile
  std::vector<double> all;
  const auto transforms = onlooker.transforms();
  const auto first = robot.sent().begin()->second;
  for (const auto& [stamp, sent] : robot.sent()) {
    const auto found = transforms.find(stamp);
    if (sent - first < std::chrono::duration<double>(kCaughtUp) || found == transforms.end())
      continue;
    all.push_back(std::chrono::duration<double, std::milli>(found->second - sent).count());
  }
  ASSERT_FALSE(all.empty());
  std::sort(all.begin(), all.end());
  const auto at = [&](double share) {
    return all[static_cast<std::size_t>(share * static_cast<double>(all.size() - 1))];
  };
  std::printf(
      "scan published to pose on tf: %zu scans, ms: median %.1f, p95 %.1f, p99 %.1f, max %.1f\n",
      all.size(), at(0.5), at(0.95), at(0.99), all.back());
}

void expect_same_grid(const Grid& grid, const Path& map) {
  std::ifstream in(map / "occupancy.pgm", std::ios::binary);
  std::string magic;
  std::uint32_t width = 0, height = 0;
  int most = 0;
  in >> magic >> width >> height >> most;
  in.get();
  ASSERT_EQ(grid.width, width);
  ASSERT_EQ(grid.height, height);
  ASSERT_EQ(grid.cells.size(), std::size_t{width} * height);
  std::size_t differ = 0, known = 0;
  for (std::uint32_t row = height; row-- > 0;) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const int pixel = in.get();
      const int cell = pixel == 0 ? 100 : pixel == 254 ? 0 : -1;  // map_server, trinary
      differ += grid.cells[std::size_t{row} * width + x] != cell;
      known += cell >= 0;
    }
  }
  EXPECT_EQ(differ, 0u);
  EXPECT_GT(known, 1000u);
}

class LiveRobot : public ::testing::Test {
 protected:
  void start(const std::vector<std::string>& more) {
    start("ros2:" + std::to_string(domain_), more);
  }
  void start(const std::string& input, const std::vector<std::string>& more) {
    map_ = scratch() / ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(map_);
    log_ = map_.string() + ".log";
    std::vector<std::string> arguments{"map", input, "--output", map_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    child_ = program::start(arguments, log_);
  }
  nlohmann::json metrics() const { return json_of(map_ / "metrics.json"); }
  std::string log() const { return program::text_of(log_); }

  int domain_ = own_domain();
  Path map_, log_;
  pid_t child_ = 0;
};

TEST_F(LiveRobot, RealTimeGivesTheMapOfItsRecordingAndReceivesIt) {
  const Path folder = recorded("office", "60");
  const Path from_file = scratch() / "from_file";
  ASSERT_EQ(program::run({"map", folder / "recording", "--mode", "online", "--output", from_file,
                          "--quiet"}),
            0);
  Onlooker onlooker(domain_);
  start({"--publish"});
  std::int64_t frames = 0;
  {
    RecordedRobot robot(folder / "recording", domain_);
    ASSERT_TRUE(robot.await_subscribers()) << log();
    robot.play(1, [] { return false; });
    frames = robot.frames();
    print_latency(robot, onlooker);
  }
  ASSERT_EQ(program::wait_for(child_), 0) << log();  // it ends by itself: nobody publishes
  EXPECT_EQ(missed(metrics()), 0) << metrics()["skipped"];
  EXPECT_EQ(metrics()["counts"]["steps"].get<std::int64_t>(), frames);
  const double live = position_error(map_, folder), file = position_error(from_file, folder);
  std::printf("ATE live %.4f m, from the file %.4f m\n", live, file);
  EXPECT_LT(live, file + 0.01);
  EXPECT_GT(onlooker.maps(), 1);
  expect_same_grid(onlooker.grid(), map_);
}

TEST_F(LiveRobot, TenTimesTooFastIsCountedSaidAndStillRight) {
  const Path folder = recorded("office", "60");
  start({});
  std::int64_t published = 0;
  {
    RecordedRobot robot(folder / "recording", domain_);
    ASSERT_TRUE(robot.await_subscribers()) << log();
    robot.play(10, [] { return false; });
    published = robot.frames();
  }
  ASSERT_EQ(program::wait_for(child_), 0) << log();
  const auto found = metrics();
  const std::int64_t dropped = missed(found);
  std::printf("%ld of %ld scans and images dropped or lost\n", static_cast<long>(dropped),
              static_cast<long>(published));
  EXPECT_EQ(found["counts"]["steps"].get<std::int64_t>() + dropped, published) << found["skipped"];
  if (dropped > 0) {
    EXPECT_NE(log().find("were dropped"), std::string::npos) << log();
  }
  const double error = position_error(map_, folder);
  std::printf("ATE %.4f m\n", error);
  EXPECT_LT(error, 0.05);
}

TEST_F(LiveRobot, FileIsReplayedAtItsRate) {
  const Path folder = recorded("room", "12");
  ::setenv("ROS_DOMAIN_ID", std::to_string(domain_).c_str(), 1);
  Onlooker onlooker(domain_);
  const auto begin = Clock::now();
  start(folder / "recording", {"--publish", "--rate", "4", "--quiet"});
  ASSERT_EQ(program::wait_for(child_), 0) << log();
  EXPECT_GE(Clock::now() - begin, std::chrono::seconds(3));  // 12 s of it
  EXPECT_GT(onlooker.transforms().size(), 100u);
  expect_same_grid(onlooker.grid(), map_);
}

TEST_F(LiveRobot, SignalEndsTheRunWithAMap) {
  const Path folder = recorded("room", "12");
  start({});
  RecordedRobot robot(folder / "recording", domain_);
  ASSERT_TRUE(robot.await_subscribers()) << log();
  const auto until = Clock::now() + std::chrono::seconds(5);
  EXPECT_FALSE(robot.play(1, [&] { return Clock::now() > until; }));
  ::kill(child_, SIGINT);  // the robot is there, and silent
  EXPECT_EQ(program::wait_for(child_), 0) << log();
  EXPECT_TRUE(std::filesystem::exists(map_ / "occupancy.pgm")) << log();
}

TEST_F(LiveRobot, NothingToMapListsWhatWasDiscovered) {
  FastRobot robot(domain_);
  robot.advertise("/chatter", "std_msgs/msg/String", {true, false, 1});
  ros2::LiveOptions options;
  options.first = 5;
  try {
    ros2::open_live("ros2:" + std::to_string(domain_), {}, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("/chatter (std_msgs/String"), std::string::npos)
        << error.what();
  }
}

TEST_F(LiveRobot, SignalEndsTheWaitForARobot) {
  start({});
  for (int i = 0; i < 600 && log().find("waits for") == std::string::npos; ++i) ::usleep(20000);
  ::kill(child_, SIGTERM);
  EXPECT_EQ(program::wait_for(child_), 1);
  EXPECT_NE(log().find("interrupted"), std::string::npos) << log();
}

}  // namespace
}  // namespace lamina::test
