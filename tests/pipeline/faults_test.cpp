// What goes wrong on real robots: frames lost, clocks that jump, wheels that stand still, people
// that walk through, robots carried away. Either the map stays right, or the run says that it lost
// its way.
#include <optional>
#include <random>

#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/recording.hpp>

#include "pipeline/faulty_room.hpp"

namespace lamina {
namespace {

TEST(Faults, NothingWrongIsTheMeasure) {
  const Folder folder;
  simulate_room(folder.path() / "data");
  const Outcome outcome = map_and_evaluate(folder, folder.path() / "data");
  EXPECT_LT(outcome.ate, 0.01);
  EXPECT_FALSE(outcome.says_lost);
}

TEST(Faults, LostFrames) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data);
  int n = 0;
  edit_lines(data / "scans.csv", [&](double time, std::string&) {
    const bool gap = time > kStart + 10 && time < kStart + 11;
    return ++n % 2 == 0 && !gap;
  });
  EXPECT_LT(map_and_evaluate(folder, data).ate, 0.02);
}

TEST(Faults, AClockThatJumpsASecond) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data);
  for (const char* file : {"scans.csv", "odometry.txt", "groundtruth.txt"}) {
    edit_lines(data / file, [](double time, std::string& line) {
      if (time > kStart + 12) line = with_time(line, time + 1);
      return true;
    });
  }
  EXPECT_LT(map_and_evaluate(folder, data).ate, 0.02);
}

TEST(Faults, WheelsThatStandStillForThreeSeconds) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data);
  std::string held;
  edit_lines(data / "odometry.txt", [&](double time, std::string& line) {
    if (time > kStart + 8 && time < kStart + 11) {
      if (held.empty()) held = line;
      line = with_time(held, time);
    }
    return true;
  });
  const Outcome outcome = map_and_evaluate(folder, data);
  EXPECT_TRUE(outcome.ate < 0.05 || outcome.says_lost) << outcome.ate;
}

// Fifteen beams in a row end a metre away, moving on from scan to scan.
TEST(Faults, APersonWalksThrough) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data);
  edit_ranges(data / "scans.csv", [](int scan, int beam, double range) {
    const double u = (beam - 40 - (7 * scan) % 200 - 7) / 7.5;
    return std::abs(u) < 1 ? 1.3 - 0.2 * std::sqrt(1 - u * u) : range;
  });
  const Outcome outcome = map_and_evaluate(folder, data);
  EXPECT_LT(outcome.ate, 0.02);
  EXPECT_EQ(outcome.spurious, 0u);
}

// Every tenth beam ends anywhere: sun, dust, mixed pixels.
TEST(Faults, TenPercentOfTheRangesAreGrosslyWrong) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data);
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> any(0, 1);
  edit_ranges(data / "scans.csv", [&](int, int, double range) {
    const bool wrong = any(rng) < 0.1;
    const double elsewhere = 0.2 + 8 * any(rng);
    return wrong ? elsewhere : range;
  });
  const Outcome outcome = map_and_evaluate(folder, data);
  EXPECT_LT(outcome.ate, 0.02);
  EXPECT_EQ(outcome.spurious, 0u);
}

// The whole north wall is a pane: nine beams of ten go through or are lost, those near its normal
// come back, and behind it other things return some.
TEST(Faults, AWallOfGlass) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data);
  std::vector<double> stamps;
  edit_lines(data / "scans.csv", [&](double time, std::string&) {
    stamps.push_back(time);
    return true;
  });
  const Trajectory truth = Trajectory::read_tum(data / "groundtruth.txt");
  const SE3 T_body_lidar = open_recording(data.string())->calibration().lidar->T_body_lidar;
  std::mt19937 rng(6);
  std::uniform_real_distribution<double> any(0, 1);
  const auto [first, step] = [&] {
    std::ifstream in(data / "scans.csv");
    std::string line;
    while (std::getline(in, line) && (line.empty() || line[0] == '#')) continue;
    std::stringstream cells(line);
    double t, angle_min, increment;
    char comma;
    cells >> t >> comma >> angle_min >> comma >> increment;
    return std::pair(angle_min, increment);
  }();
  int panes = 0;
  edit_ranges(data / "scans.csv", [&](int scan, int beam, double range) {
    const auto pose = truth.at(Timestamp::from_seconds(stamps[static_cast<std::size_t>(scan)]));
    if (!pose) return range;
    const double a = first + beam * step;
    const SE3 T = *pose * T_body_lidar;
    const Eigen::Vector3d towards = T.so3() * Eigen::Vector3d(std::cos(a), std::sin(a), 0);
    const Eigen::Vector3d end = T.translation() + range * towards;
    constexpr double kWall = 3;  // m: the room is 6 m wide
    if (!(range > 0) || std::abs(end.y() - kWall) > 0.1) return range;
    ++panes;
    if (towards.y() > 0.995) return range;  // within six degrees of the normal
    const double what = any(rng);
    return what < 0.1 ? range : what < 0.8 ? 0.0 : range + 0.3 + 3 * any(rng);
  });
  ASSERT_GT(panes, 1000);
  const Outcome outcome = map_and_evaluate(folder, data);
  EXPECT_LT(outcome.ate, 0.02);
  EXPECT_EQ(outcome.spurious, 0u);
}

// Carried for five seconds with wheels and scanner off.
TEST(Faults, ARobotCarriedAwaySaysSoOrFindsItself) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data);
  const auto carried = [](double time) { return time > kStart + 10 && time < kStart + 15; };
  edit_lines(data / "scans.csv", [&](double time, std::string&) { return !carried(time); });
  std::optional<SE3> put_down, picked_up;
  edit_lines(data / "odometry.txt", [&](double time, std::string& line) {
    std::stringstream in(line);
    double t, x, y, z, qx, qy, qz, qw;
    in >> t >> x >> y >> z >> qx >> qy >> qz >> qw;
    const SE3 pose(SO3(Eigen::Quaterniond(qw, qx, qy, qz)), {x, y, z});
    if (time <= kStart + 10) picked_up = pose;
    if (carried(time)) return false;
    if (time <= kStart + 10) return true;
    if (!put_down) put_down = pose;
    const SE3 observed = *picked_up * (put_down->inverse() * pose);
    const auto& q = observed.so3().quaternion();
    std::ostringstream out;
    out.precision(15);
    out << t << ' ' << observed.translation().x() << ' ' << observed.translation().y() << ' '
        << observed.translation().z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' '
        << q.w();
    line = out.str();
    return true;
  });
  const Outcome outcome = map_and_evaluate(folder, data);
  EXPECT_TRUE(outcome.ate < 0.05 || outcome.says_lost) << outcome.ate;
}

}  // namespace
}  // namespace lamina
