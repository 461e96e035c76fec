// Loops in worlds whose answer is known; and where there must be none.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <algorithm>
#include <filesystem>

#include <lamina/frontend/loops/loop_closer.hpp>
#include <lamina/models/model_archive.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

using testing::Scanner;
using testing::Wall;

/// A ring of corridors, 2 m wide, 14 x 10 m outside, with niches that differ.
std::vector<Wall> ring() {
  std::vector<Wall> walls;
  const auto path = [&](std::vector<Eigen::Vector2d> p) {
    for (std::size_t i = 0; i + 1 < p.size(); ++i) walls.push_back({p[i], p[i + 1]});
  };
  path({{0, 0},    {3, 0},      {3, -0.6}, {4.5, -0.6}, {4.5, 0},  {14, 0},   {14, 4},
        {14.7, 4}, {14.7, 5.2}, {14, 5.2}, {14, 10},    {9, 10},   {9, 10.5}, {7, 10.5},
        {7, 10},   {0, 10},     {0, 7},    {-0.4, 7},   {-0.4, 5}, {0, 5},    {0, 0}});
  path({{2, 2},
        {6, 2},
        {6, 2.5},
        {7.2, 2.5},
        {7.2, 2},
        {12, 2},
        {12, 8},
        {5, 8},
        {5, 7.4},
        {3.5, 7.4},
        {3.5, 8},
        {2, 8},
        {2, 2}});
  return walls;
}

/// The pose after s metres round the ring: a rectangle with quarter circles of 1 m.
SE3 on_ring(double s) {
  const double a = 10, b = 6, arc = M_PI / 2;
  const double length = 2 * (a + b) + 4 * arc;
  s = std::fmod(s, length);
  SE3 T = SE3::planar(2, 1, 0);
  for (const double side : {a, b, a, b}) {
    if (s <= side) return T * SE3::planar(s, 0, 0);
    s -= side;
    T = T * SE3::planar(side, 0, 0);
    if (s <= arc) return T * SE3::planar(std::sin(s), 1 - std::cos(s), s);
    s -= arc;
    T = T * SE3::planar(1, 1, M_PI / 2);
  }
  return T;
}

struct Result {
  std::vector<LoopClosure> loops;
  std::vector<SE3> truth;  ///< from the first pose
  std::vector<SE3> odometry;
  Trajectory corrected;
  LoopCloser::Counts counts;
  std::vector<int> estimated;      ///< poses of its graph, likewise
  std::vector<std::size_t> kept;   ///< bytes of its archive, each 60 m
  std::string archived;            ///< the last of these
  std::vector<std::size_t> bytes;  ///< of its submaps in memory, likewise
};

/// A motion of the drive that is said to turn by `turn` (rad) too much, after that way (m); and
/// what each motion's heading (rad) and way (m) are said to be off by, 1-sigma.
struct Accident {
  double way = 0, turn = 0, sigma_turn = 0.006, sigma_way = 0.004;
  int beams = 181;  ///< of the scanner, over half a circle
};

/// Drives `metres` of `way`; the motion given to the closer turns by `bend` rad/m too much, and a
/// share `strays` of the returns lies anywhere in between.
template <typename Way>
Result drive(const std::vector<Wall>& walls, Way way, double metres, double bend,
             const LoopCloserOptions& options = {}, double strays = 0, Accident accident = {},
             const std::filesystem::path& folder = {}) {
  Scanner scanner;
  scanner.beams = accident.beams;
  scanner.fov = M_PI;
  LoopCloser closer(options);
  if (!folder.empty()) closer.keep_submaps_in(folder);
  Result r;
  SE3 T;
  const double step = 0.15;
  const auto keep = [&](std::vector<LoopClosure> l) {
    r.loops.insert(r.loops.end(), l.begin(), l.end());
  };
  for (int i = 0; i * step < metres; ++i) {
    const SE3 truth = way(i * step);
    ScanMotion motion;
    if (i > 0) {
      const bool now = (i - 1) * step < accident.way && accident.way <= i * step;
      motion.T_prev_curr_body = way((i - 1) * step).inverse() * truth *
                                SE3::planar(0, 0, bend * step + (now ? accident.turn : 0));
      motion.covariance = Matrix6d::Identity() * 1e-6;
      motion.covariance(0, 0) = motion.covariance(1, 1) = std::pow(accident.sigma_way, 2);
      motion.covariance(5, 5) = std::pow(accident.sigma_turn, 2);
    }
    T = T * motion.T_prev_curr_body;
    LaserScan scan = scanner.scan(walls, truth, i);
    std::uniform_real_distribution<float> any(0, 1);
    for (float& range : scan.ranges) {
      if (any(scanner.rng) < static_cast<float>(strays)) range *= any(scanner.rng);
    }
    keep(closer.add(scan, motion));
    r.truth.push_back(way(0).inverse() * truth);
    r.odometry.push_back(T);
    if (i % 400 != 399) continue;
    ArchiveWriter archive;
    archive(closer);
    r.archived = archive.bytes();
    r.kept.push_back(r.archived.size());
    r.bytes.push_back(closer.bytes());
    r.estimated.push_back(closer.estimated());
  }
  keep(closer.finish());
  r.corrected = closer.corrected();
  r.counts = closer.counts();
  return r;
}

double worst(const std::vector<SE3>& truth, const auto& pose_at) {
  double most = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    most = std::max(most, (truth[i].translation() - pose_at(i).translation()).norm());
  }
  return most;
}

/// m that the loop which is furthest off misses the true motion by; 0 without loops.
double worst_loop(const Result& r) {
  double most = 0;
  for (const LoopClosure& l : r.loops) {
    const auto from = static_cast<std::size_t>(l.from.seconds() + 0.5);
    const auto to = static_cast<std::size_t>(l.to.seconds() + 0.5);
    const SE3 d = (r.truth[from].inverse() * r.truth[to]).inverse() * l.T_from_to;
    most = std::max(most, d.translation().norm());
  }
  return most;
}

TEST(LoopCloser, ClosesARingThatOdometryLeavesOpen) {
  const Result r = drive(ring(), on_ring, 60, 0.004);
  ASSERT_GE(r.loops.size(), 2U);
  for (const LoopClosure& l : r.loops) {
    const auto from = static_cast<std::size_t>(l.from.seconds() + 0.5);
    const auto to = static_cast<std::size_t>(l.to.seconds() + 0.5);
    EXPECT_LT(from, to);
    const SE3 d = (r.truth[from].inverse() * r.truth[to]).inverse() * l.T_from_to;
    EXPECT_LT(d.translation().norm(), 0.08);
    EXPECT_LT(d.so3().log().norm(), 0.015);
    EXPECT_GT(l.covariance.determinant(), 0);
  }
  const double before = worst(r.truth, [&](std::size_t i) { return r.odometry[i]; });
  const double after = worst(r.truth, [&](std::size_t i) { return r.corrected[i].pose; });
  EXPECT_GT(before, 0.8);
  EXPECT_LT(after, 0.35 * before);
  EXPECT_EQ(r.corrected.size(), r.truth.size());
}

// All the drift of heading arose in one place: by a covariance that spreads it over the way, place
// and heading do not go together, though neither is off by more than some three sigmas.
TEST(LoopCloser, DriftMayHaveArisenInOnePlace) {
  const Result r = drive(ring(), on_ring, 42, 0, {}, 0,
                         {.way = 37, .turn = 0.1, .sigma_turn = 0.002, .sigma_way = 0.001});
  ASSERT_FALSE(r.loops.empty());
  for (const LoopClosure& l : r.loops) {
    const auto from = static_cast<std::size_t>(l.from.seconds() + 0.5);
    const auto to = static_cast<std::size_t>(l.to.seconds() + 0.5);
    const SE3 d = (r.truth[from].inverse() * r.truth[to]).inverse() * l.T_from_to;
    EXPECT_LT(d.translation().norm(), 0.1);
    EXPECT_LT(d.so3().log().norm(), 0.03);
  }
}

TEST(LoopCloser, StrayReturnsDoNotContradict) {
  const Result clean = drive(ring(), on_ring, 60, 0.004);
  const Result r = drive(ring(), on_ring, 60, 0.004, {}, 0.03);
  EXPECT_GE(r.loops.size() + 1, clean.loops.size());
  EXPECT_LE(r.counts.contradicted, clean.counts.contradicted + 1);
}

TEST(ScanPoints, ReturnsThatStandAloneGo) {
  const auto at = [](double x, double y) { return OrientedPoint{{x, y}, {-1, 0}, 0.01}; };
  // A wall 10 m away: 0.9 m between neighbours is near there.
  const auto kept =
      without_lone({at(10, 0), at(10, 0.8), at(3, 0.3), at(10, 1.9), at(10, 2.7)}, {0, 0}, 0.4);
  ASSERT_EQ(kept.size(), 4U);
  for (const OrientedPoint& p : kept) EXPECT_EQ(p.point.x(), 10);
  EXPECT_TRUE(without_lone({at(1, 0)}, {0, 0}).empty());
  EXPECT_TRUE(without_lone({}, {0, 0}).empty());
}

TEST(LoopCloser, PlacesSeenOftenAreKeptButOnce) {
  LoopCloserOptions options;
  options.visits = 1;
  options.keep_path = false;
  const Result r = drive(ring(), on_ring, 300, 0.0005, options);
  const Result all = drive(ring(), on_ring, 300, 0.0005);
  ASSERT_EQ(r.kept.size(), 5U);
  EXPECT_LT(r.kept.back(), r.kept[1] + r.kept[1] / 5);  // of three laps
  EXPECT_GT(all.kept.back(), 3 * all.kept.front());
  ASSERT_EQ(r.bytes.size(), 5U);
  EXPECT_LT(4 * r.bytes.back(), all.bytes.back());  // what is let go gives its memory back
  EXPECT_TRUE(r.corrected.empty());
  EXPECT_LE(r.estimated.back(), r.estimated[1] + 4);  // nor does the graph grow with the laps
  EXPECT_GT(all.estimated.back(), 3 * r.estimated.back());
  // Loops are found in the last lap as in the second.
  EXPECT_GT(std::count_if(r.loops.begin(), r.loops.end(),
                          [](const LoopClosure& l) { return l.to.seconds() > 1600; }),
            4);
  EXPECT_LT(worst_loop(r), 0.08);
}

TEST(LoopCloser, FindsNoneInABareCorridor) {
  const auto way = [](double s) {
    return s < 20 ? SE3::planar(s, 0, 0) : SE3::planar(40 - s, 0.1, M_PI);
  };
  const Result r = drive(testing::corridor(), way, 36, 0.0005);
  EXPECT_TRUE(r.loops.empty());
  EXPECT_GT(r.counts.submaps, 8);
}

/// Walls 2.4 m apart with pillars of 40 by 25 cm before them, on either side in turn.
std::vector<Wall> pillars(const std::vector<double>& at) {
  std::vector<Wall> walls{{{-8, -1.2}, {60, -1.2}}, {{-8, 1.2}, {60, 1.2}}};
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double x = at[i], wall = i % 2 ? -1.2 : 1.2, face = i % 2 ? -0.95 : 0.95;
    walls.push_back({{x, wall}, {x, face}});
    walls.push_back({{x, face}, {x + 0.4, face}});
    walls.push_back({{x + 0.4, face}, {x + 0.4, wall}});
  }
  return walls;
}

/// 40 m out and back, and again.
SE3 up_and_down(double s) {
  s = std::fmod(s, 80);
  return s < 40 ? SE3::planar(s, 0, 0) : SE3::planar(80 - s, 0.1, M_PI);
}

// Walls fit wherever along them; where wheels leave more than a pillar's distance open, it is the
// faces across that tell places apart, few as they are.
TEST(LoopCloser, FacesAcrossACorridorTellItsPlaces) {
  const auto walls = pillars({-4.1, 1.3, 4.6, 11, 14.2, 20.9, 24.1, 29.5, 36, 39.4, 45.2, 49, 56});
  const Result r =
      drive(walls, up_and_down, 110, 0, {}, 0,
            {.way = 1e9, .turn = 0, .sigma_turn = 0.0005, .sigma_way = 0.06, .beams = 361});
  const auto late = std::count_if(r.loops.begin(), r.loops.end(), [](const LoopClosure& l) {
    return l.to.seconds() - l.from.seconds() > 300;  // 45 m and more of way between
  });
  EXPECT_GE(late, 7);
  EXPECT_LT(worst_loop(r), 0.1);
}

// Nor where nothing tells a place from the next.
TEST(LoopCloser, PlacesThatMatchNothingAreKeptButTwice) {
  const auto way = [](double s) {
    const double on = std::fmod(s, 40);
    return on < 20 ? SE3::planar(on, 0, 0) : SE3::planar(40 - on, 0.1, M_PI);
  };
  LoopCloserOptions options;
  options.visits = 1;
  options.keep_path = false;
  const Accident sure{.sigma_turn = 0.0001, .sigma_way = 0.001};
  const Result r = drive(testing::corridor(), way, 300, 0, options, 0, sure);
  ASSERT_EQ(r.estimated.size(), 5U);
  EXPECT_TRUE(r.loops.empty());
  EXPECT_GT(r.counts.submaps, 80);
  EXPECT_LE(r.estimated.back(), r.estimated[2] + 2);
}

TEST(LoopCloser, GoesOnFromItsArchiveAsIfNothingHadBeen) {
  LoopCloserOptions options;
  options.visits = 1;
  options.keep_path = false;
  LoopCloser on(options), back(options);
  on.keep_submaps_in(std::filesystem::temp_directory_path());
  const std::vector<Wall> walls = ring();
  Scanner scanner;
  scanner.beams = 181;
  scanner.fov = M_PI;
  const int half = 700, all = 1200;
  int passed = 0;
  for (int i = 0; i < all; ++i) {
    ScanMotion motion;
    if (i > 0) motion.T_prev_curr_body = on_ring(0.15 * (i - 1)).inverse() * on_ring(0.15 * i);
    motion.covariance = Matrix6d::Identity() * 1e-6;
    motion.covariance.diagonal().head<2>().setConstant(1.6e-5);
    motion.covariance(5, 5) = 3.6e-5;
    const LaserScan scan = scanner.scan(walls, on_ring(0.15 * i), i);
    const auto loops = on.add(scan, motion);
    if (i == half) {
      passed = on.counts().passed;
      ArchiveWriter archive;
      archive(on);
      ArchiveReader reader(archive.bytes());
      reader(back);
    } else if (i > half) {
      EXPECT_EQ(back.add(scan, motion).size(), loops.size());
    }
  }
  EXPECT_GT(passed, 5);
  EXPECT_GT(on.counts().passed, passed + 5);
  ArchiveWriter a, b;
  a(on);
  b(back);
  EXPECT_EQ(a.bytes(), b.bytes());
}

// Where they are alike, those a pitch away are not believed.
TEST(LoopCloser, EqualPillarsTellNoPlace) {
  std::vector<double> at;
  for (int i = -2; i < 17; ++i) at.push_back(3.5 * i);
  const Result r =
      drive(pillars(at), up_and_down, 90, 0, {}, 0,
            {.way = 20, .turn = 0, .sigma_turn = 0.0005, .sigma_way = 0.1, .beams = 361});
  EXPECT_GT(r.counts.ambiguous, 10);
  EXPECT_LT(worst_loop(r), 0.1);
}

TEST(LoopCloser, SubmapsOnFileTellTheSameLoopsInNextToNoMemory) {
  const auto folder = std::filesystem::temp_directory_path();
  const Result held = drive(ring(), on_ring, 120, 0.001);
  const Result filed = drive(ring(), on_ring, 120, 0.001, {}, 0, {}, folder);
  ASSERT_GT(held.loops.size(), 10U);
  ASSERT_EQ(filed.loops.size(), held.loops.size());
  for (std::size_t i = 0; i < held.loops.size(); ++i) {
    EXPECT_EQ(filed.loops[i].to, held.loops[i].to);
    EXPECT_EQ(filed.loops[i].T_from_to.translation(), held.loops[i].T_from_to.translation());
  }
  EXPECT_EQ(filed.archived, held.archived);
  EXPECT_LT(10 * filed.bytes.back(), held.bytes.back());
  // An archive goes on where it was made: from file to memory and back.
  ArchiveReader reader(held.archived);
  LoopCloser back;
  back.keep_submaps_in(folder);
  reader(back);
  ArchiveWriter again;
  again(back);
  EXPECT_EQ(again.bytes(), held.archived);
}

TEST(LoopCloser, NothingInNothingOut) {
  LoopCloser closer;
  EXPECT_TRUE(closer.finish().empty());
  EXPECT_TRUE(closer.corrected().empty());
  LaserScan empty;
  EXPECT_TRUE(closer.add(empty, {}).empty());
  EXPECT_TRUE(closer.finish().empty());
  EXPECT_EQ(closer.corrected().size(), 1U);
}

TEST(Agreement, APointInFrontOfASeenWallContradicts) {
  std::vector<OrientedPoint> wall;
  for (int i = -20; i <= 20; ++i) wall.push_back({{2, 0.05 * i}, {-1, 0}, 0.01});
  const std::vector<SightFan> fans{sight_fan(wall, {0, 0}, {})};
  const FanAgreement same = agreement(fans, wall, {}, 0.2);
  EXPECT_EQ(same.contradict, 0);
  EXPECT_EQ(same.agree, 41);
  const FanAgreement nearer = agreement(fans, wall, {-1, 0, 0}, 0.2);
  EXPECT_EQ(nearer.agree, 0);
  EXPECT_GT(nearer.contradict, 15);
  const FanAgreement hidden = agreement(fans, wall, {1, 0, 0}, 0.2);
  EXPECT_EQ(hidden.agree + hidden.contradict, 0);
}

}  // namespace
}  // namespace lamina
