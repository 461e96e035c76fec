// What goes wrong on real robots: frames lost, clocks that jump, wheels that stand still, people
// that walk through, robots carried away. Either the map stays right, or the run says that it lost
// its way.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <random>
#include <sstream>

#include <lamina/apps/evaluation.hpp>
#include <lamina/apps/mapping.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sim/dataset.hpp>

namespace lamina::apps {
namespace {

namespace fs = std::filesystem;

// A fresh folder that goes with the test.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "lamina_faults_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// One lap of the furnished room by scans and wheels.
void simulate_room(const fs::path& folder) {
  sim::DatasetOptions options;
  options.grid = false;
  sim::write_dataset(sim::make_scene("room", {{"camera.enabled", "false"}}), folder, options);
}

// Every line of a file through `edit(time, line)`; false drops it. Comments stay.
void edit_lines(const fs::path& file, const std::function<bool(double, std::string&)>& edit) {
  std::ifstream in(file);
  std::stringstream out;
  for (std::string line; std::getline(in, line);) {
    char* end = nullptr;
    const double time = std::strtod(line.c_str(), &end);
    const bool data = end != line.c_str();
    if (!data || edit(time, line)) out << line << '\n';
  }
  in.close();
  std::ofstream(file) << out.str();
}

// The line with another number in front.
std::string with_time(const std::string& line, double time) {
  std::ostringstream out;
  out.precision(15);
  out << time << line.substr(line.find_first_of(", "));
  return out.str();
}

// Every range of scans.csv through `edit(scan, beam, range)`.
void edit_ranges(const fs::path& file, const std::function<double(int, int, double)>& edit) {
  int scan = 0;
  edit_lines(file, [&](double, std::string& line) {
    constexpr int kHead = 5;  // timestamp, angles, limits
    std::stringstream in(line);
    std::string out, cell;
    for (int i = 0; std::getline(in, cell, ','); ++i) {
      if (i >= kHead) cell = std::to_string(edit(scan, i - kHead, std::stod(cell)));
      out += (i > 0 ? "," : "") + cell;
    }
    line = out;
    ++scan;
    return true;
  });
}

struct Outcome {
  double ate = 0;
  int poses = 0;
  std::size_t spurious = 0;
  bool says_lost = false;
};

Outcome map_and_evaluate(const Folder& folder, const fs::path& data) {
  MapRequest request;
  request.input = data.string();
  request.output = folder.path() / "map";
  request.quiet = true;
  EXPECT_EQ(run_map(request), 0);
  const Evaluation evaluation = evaluate(request.output, data);
  std::ifstream metrics(request.output / "metrics.json");
  const std::string text((std::istreambuf_iterator<char>(metrics)), {});
  Outcome outcome;
  outcome.ate = evaluation.trajectory->ate_m.rmse;
  outcome.poses = evaluation.trajectory->matched;
  outcome.spurious = evaluation.planes->spurious.size();
  outcome.says_lost = text.find("steps_with_tracking_lost") != std::string::npos;
  return outcome;
}

constexpr double kStart = 1000;  // s: first stamp of simulated recordings

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
    const SE3 told = *picked_up * (put_down->inverse() * pose);
    const auto& q = told.so3().quaternion();
    std::ostringstream out;
    out.precision(15);
    out << t << ' ' << told.translation().x() << ' ' << told.translation().y() << ' '
        << told.translation().z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w();
    line = out.str();
    return true;
  });
  const Outcome outcome = map_and_evaluate(folder, data);
  EXPECT_TRUE(outcome.ate < 0.05 || outcome.says_lost) << outcome.ate;
}

}  // namespace
}  // namespace lamina::apps
