// The faults of faults_test.cpp where one sensor is all there is: scans without wheels, a depth
// camera without either. Nothing else can tell the motion: what is not seen is said.
#include <algorithm>
#include <random>
#include <utility>

#include <lamina/models/trajectory.hpp>

#include "pipeline/faulty_room.hpp"

namespace lamina {
namespace {

using Gap = std::pair<double, double>;

// Drops what lies within the gap (s since the start).
void cut(const fs::path& file, const Gap& gap) {
  edit_lines(file, [&](double time, std::string&) {
    return time <= kStart + gap.first || time >= kStart + gap.second;
  });
}

// The same, with stamps of what follows moved by `shift` s.
void jump(const fs::path& file, double from, double shift) {
  edit_lines(file, [&](double time, std::string& line) {
    if (time > kStart + from) line = with_time(line, time + shift);
    return true;
  });
}

// Within the gap the last line before it again and again, with the stamps of its own.
void freeze(const fs::path& file, const Gap& gap) {
  std::string held;
  edit_lines(file, [&](double time, std::string& line) {
    if (time <= kStart + gap.first) held = line;
    if (time > kStart + gap.first && time < kStart + gap.second) line = with_time(held, time);
    return true;
  });
}

class ScansAlone : public testing::Test {
 protected:
  void SetUp() override { simulate_room(data_, Senses::kScans); }
  Outcome outcome() { return map_and_evaluate(folder_, data_); }
  Folder folder_;
  fs::path data_ = folder_.path() / "data";
  fs::path scans_ = data_ / "scans.csv";
};

TEST_F(ScansAlone, NothingWrongIsTheMeasure) {
  const Outcome o = outcome();
  EXPECT_LT(o.ate, 0.01);
  EXPECT_FALSE(o.says_lost);
}

TEST_F(ScansAlone, LostFrames) {
  int n = 0;
  edit_lines(scans_, [&](double, std::string&) { return ++n % 2 == 0; });
  cut(scans_, {10, 11});
  const Outcome o = outcome();
  EXPECT_LT(o.ate, 0.02);
  EXPECT_FALSE(o.says_lost);
}

TEST_F(ScansAlone, AClockThatJumpsASecond) {
  jump(scans_, 12, 1);
  jump(data_ / "groundtruth.txt", 12, 1);
  EXPECT_LT(outcome().ate, 0.02);
}

TEST_F(ScansAlone, APersonWalksThrough) {
  edit_ranges(scans_, [](int scan, int beam, double range) {
    const double u = (beam - 40 - (7 * scan) % 200 - 7) / 7.5;
    return std::abs(u) < 1 ? 1.3 - 0.2 * std::sqrt(1 - u * u) : range;
  });
  const Outcome o = outcome();
  EXPECT_LT(o.ate, 0.02);
  EXPECT_EQ(o.spurious, 0u);
}

TEST_F(ScansAlone, TenPercentOfTheRangesAreGrosslyWrong) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> any(0, 1);
  edit_ranges(scans_, [&](int, int, double range) {
    const bool wrong = any(rng) < 0.1;
    const double elsewhere = 0.2 + 8 * any(rng);
    return wrong ? elsewhere : range;
  });
  const Outcome o = outcome();
  EXPECT_LT(o.ate, 0.02);
  EXPECT_EQ(o.spurious, 0u);
}

TEST_F(ScansAlone, AFrozenScannerIsSaid) {
  freeze(scans_, {10, 13});
  const Outcome o = outcome();
  EXPECT_TRUE(o.ate < 0.05 || o.says_lost) << o.ate;
}

// Over the first gap the robot comes where nothing fits; over the second to the other end of the
// room, which looks nearly the same.
TEST_F(ScansAlone, ARobotCarriedAwaySaysSo) {
  cut(scans_, {10, 15});
  const Outcome o = outcome();
  EXPECT_TRUE(o.says_lost);
  EXPECT_NEAR(o.lost_after, kStart + 10, 0.11);
}

TEST_F(ScansAlone, ARobotCarriedToAPlaceThatLooksAlikeSaysSo) {
  cut(scans_, {5, 25});
  const Outcome o = outcome();
  EXPECT_TRUE(o.says_lost);
  EXPECT_NEAR(o.lost_after, kStart + 5, 0.11);
}

TEST_F(ScansAlone, ACoveredScannerIsSaid) {
  edit_ranges(scans_, [](int i, int, double range) { return i > 100 && i < 150 ? 0 : range; });
  const Outcome o = outcome();
  EXPECT_TRUE(o.says_lost);
  EXPECT_NEAR(o.lost_after, kStart + 10, 0.11);
}

class DepthAlone : public testing::Test {
 protected:
  void SetUp() override { simulate_room(data_, Senses::kDepth); }
  Outcome outcome() { return map_and_evaluate(folder_, data_); }
  Folder folder_;
  fs::path data_ = folder_.path() / "data";
  fs::path depth_ = data_ / "depth.txt";
};

TEST_F(DepthAlone, NothingWrongIsTheMeasure) {
  const Outcome o = outcome();
  EXPECT_LT(o.ate, 0.04);
  EXPECT_FALSE(o.says_lost);
}

TEST_F(DepthAlone, LostFrames) {
  int n = 0;
  edit_lines(depth_, [&](double, std::string&) { return ++n % 3 != 0; });
  const Outcome o = outcome();
  EXPECT_TRUE(o.ate < 0.08 || o.says_lost) << o.ate;
}

TEST_F(DepthAlone, AClockThatJumpsASecond) {
  jump(depth_, 8, 1);
  jump(data_ / "groundtruth.txt", 8, 1);
  const Outcome o = outcome();
  EXPECT_LT(o.ate, 0.08);
}

TEST_F(DepthAlone, AFrozenCameraIsSaid) {
  freeze(depth_, {6, 9});
  const Outcome o = outcome();
  EXPECT_TRUE(o.ate < 0.05 || o.says_lost) << o.ate;
}

TEST_F(DepthAlone, TenPercentOfThePixelsAreGrosslyWrong) {
  std::mt19937 rng(7);
  edit_images(data_, [&](double, DepthImage& image) {
    for (auto& raw : image.pixels) {
      if (rng() % 10 == 0) raw = static_cast<std::uint16_t>(2000 + rng() % 30000);
    }
  });
  const Outcome o = outcome();
  EXPECT_TRUE(o.ate < 0.08 || o.says_lost) << o.ate;
}

// A cylinder of a person's width crosses the view at walking pace, from right to left and back:
// for a camera all that stands before the room, from head to feet.
TEST_F(DepthAlone, APersonWalksThrough) {
  const DepthCamera camera = *read_calibration(data_ / "calibration.yaml").depth_camera;
  edit_images(data_, [&](double time, DepthImage& image) {
    constexpr double kRadius = 0.22, kDistance = 1.6, kPace = 1.0, kPeriod = 6;  // m, m/s, s
    const double t = std::fmod(time - kStart, kPeriod) - kPeriod / 2;
    const double x = kPace * t * (std::fmod(time - kStart, 2 * kPeriod) < kPeriod ? 1 : -1);
    for (int u = 0; u < image.width; ++u) {
      // The ray (s, 1) z meets |(s z - x, z - kDistance)| = kRadius.
      const double s = (u - camera.camera.cx) / camera.camera.fx;
      const double a = s * s + 1, b = s * x + kDistance;
      const double root = b * b - a * (x * x + kDistance * kDistance - kRadius * kRadius);
      if (!(root > 0)) continue;
      const double z = (b - std::sqrt(root)) / a;
      for (int v = 0; v < image.height; ++v) {
        auto& raw = image.pixels[static_cast<std::size_t>(v * image.width + u)];
        const auto person = static_cast<std::uint16_t>(z * camera.depth_scale);
        if (raw == 0 || raw > person) raw = person;
      }
    }
  });
  const Outcome o = outcome();
  EXPECT_TRUE(o.ate < 0.08 || o.says_lost) << o.ate;
}

// One wall of the room lets the pattern through: no depth there, but for what is met head-on.
TEST_F(DepthAlone, AWallOfGlass) {
  const DepthCamera camera = *read_calibration(data_ / "calibration.yaml").depth_camera;
  const Trajectory truth = Trajectory::read_tum(data_ / "groundtruth.txt");
  std::mt19937 rng(8);
  int panes = 0;
  edit_images(data_, [&](double time, DepthImage& image) {
    const auto pose = truth.at(Timestamp::from_seconds(time));
    if (!pose) return;
    const SE3 T = *pose * camera.camera.T_body_camera;
    for (int v = 0; v < image.height; ++v) {
      for (int u = 0; u < image.width; ++u) {
        auto& raw = image.pixels[static_cast<std::size_t>(v * image.width + u)];
        const double z = raw / camera.depth_scale;
        const Eigen::Vector3d ray((u - camera.camera.cx) / camera.camera.fx,
                                  (v - camera.camera.cy) / camera.camera.fy, 1);
        constexpr double kWall = 3;  // m: the room is 6 m wide
        if (raw == 0 || std::abs((T * (z * ray)).y() - kWall) > 0.1) continue;
        ++panes;
        if ((T.so3() * ray.normalized()).y() < 0.995) raw = 0;
      }
    }
  });
  ASSERT_GT(panes, 100000);
  const Outcome o = outcome();
  EXPECT_TRUE(o.ate < 0.08 || o.says_lost) << o.ate;
}

TEST_F(DepthAlone, ARobotCarriedAwaySaysSo) {
  cut(depth_, {6, 11});
  const Outcome o = outcome();
  EXPECT_TRUE(o.says_lost);
  EXPECT_NEAR(o.lost_after, kStart + 6, 0.21);
}

TEST_F(DepthAlone, ACoveredCameraIsSaid) {
  edit_images(data_, [&](double time, DepthImage& image) {
    if (time > kStart + 6 && time < kStart + 9)
      std::fill(image.pixels.begin(), image.pixels.end(), 0);
  });
  const Outcome o = outcome();
  EXPECT_TRUE(o.says_lost);
  EXPECT_NEAR(o.lost_after, kStart + 6, 0.21);
}

}  // namespace
}  // namespace lamina
