// A keyframe's pose in another by the planes both saw, and what the mapper makes of it.
#include <gtest/gtest.h>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/mapper/relative_pose_from_planes.hpp>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

// Points on a square of a plane, 1 m wide, seen from T_map_body: exact, each good to 1 cm.
Moments seen(const Plane& plane, const Eigen::Vector3d& middle, const SE3& T_map_body,
             bool line = false) {
  const Matrix32d basis = Plane::tangent_basis(plane.normal());
  const Eigen::Vector3d level = plane.normal().cross(Eigen::Vector3d::UnitZ());
  Moments m;
  for (double u = -0.5; u <= 0.5; u += 0.1) {
    for (double v = -0.5; v <= 0.5; v += 0.1) {
      const Eigen::Vector3d x =
          middle + (line ? Eigen::Vector3d(u * level) : basis * Eigen::Vector2d(u, v));
      m.add(T_map_body.inverse() * x, 1e4);
    }
  }
  return m;
}

const Plane kFloor({0, 0, 1}, 0), kEnd({-1, 0, 0}, -4), kSide({0, 1, 0}, -1);

// Two keyframes that stand half a pace apart; the graph believes b off by `error`.
struct Pair {
  Graph graph;
  KeyframeId a, b;
  SE3 T_map_a = SE3::planar(1, 0.1, 0.1), T_map_b = SE3::planar(1.2, -0.05, 0.2);

  explicit Pair(const SE3& error) {
    a = graph.add_keyframe({}, T_map_a);
    b = graph.add_keyframe({}, T_map_b * error);
  }
  PlaneId add(const Plane& plane, const Eigen::Vector3d& middle, bool line = false) {
    const PlaneId id = graph.add_plane(PlaneLandmark::at(plane, middle));
    graph.plane_moments.push_back({a, id, seen(plane, middle, T_map_a, line)});
    // b saw another part of it.
    const Eigen::Vector3d aside = 0.3 * plane.normal().unitOrthogonal();
    const Eigen::Vector3d there = line ? middle : Eigen::Vector3d(middle + aside);
    graph.plane_moments.push_back({b, id, seen(plane, there, T_map_b, line)});
    return id;
  }
  SE3 guess() const { return graph.at(a).T_map_body.inverse() * graph.at(b).T_map_body; }
  Vector6d off(const SE3& T_a_b) const {
    return ((T_map_a.inverse() * T_map_b).inverse() * T_a_b).log();
  }
};

SE3 drift() {
  Vector6d d;
  d << 0.04, -0.06, 0.03, 0.004, -0.004, 0.008;
  return SE3::exp(d);
}

TEST(SharedPlanes, ThreePlanesTellThePoseWhateverThePosesSay) {
  Pair pair(drift());
  pair.add(kFloor, {2, 0, 0});
  pair.add(kEnd, {4, 0, 1});
  pair.add(kSide, {2, -1, 1});
  const SharedPose pose = pose_by_shared_planes(pair.graph, pair.a, pair.b, pair.guess());
  EXPECT_EQ(pose.planes, 3);
  EXPECT_LT(pair.off(pose.T_a_b).norm(), 1e-3);
  EXPECT_LT(pose.chi_squared, 0.1);
}

TEST(SharedPlanes, WhereNoPlaneTellsTheGuessStands) {
  Pair pair(drift());  // a corridor: nothing says how far along it
  pair.add(kFloor, {2, 0, 0});
  pair.add(kSide, {2, -1, 1});
  const SharedPose pose = pose_by_shared_planes(pair.graph, pair.a, pair.b, pair.guess());
  const Eigen::Vector3d off_map =
      pair.T_map_b.so3() * Eigen::Vector3d(pair.off(pose.T_a_b).head<3>());
  EXPECT_LT(off_map.tail<2>().norm(), 2e-3);
  EXPECT_GT(std::abs(off_map.x()), 0.02);
  // A guess that is right where the planes tell is believed where they do not.
  Pair settled{SE3()};
  settled.add(kFloor, {2, 0, 0});
  settled.add(kSide, {2, -1, 1});
  const SharedPose sure =
      pose_by_shared_planes(settled.graph, settled.a, settled.b, settled.guess());
  EXPECT_LT(settled.off(sure.T_a_b).norm(), 1e-6);
}

TEST(SharedPlanes, ScansTellThePoseInTheirPlane) {
  Vector6d d;
  d << 0.04, -0.06, 0, 0, 0, 0.008;
  Pair pair(SE3::exp(d));
  pair.add(kEnd, {4, 0, 0.5}, true);
  pair.add(kSide, {2, -1, 0.5}, true);
  const SharedPose pose = pose_by_shared_planes(pair.graph, pair.a, pair.b, pair.guess());
  // At the scanner's height: where below it the body stands, a lean tells as well as a step does.
  const Eigen::Vector3d there(1, 0.3, 0.5);
  const SE3 truth = pair.T_map_a.inverse() * pair.T_map_b;
  EXPECT_LT((pose.T_a_b * there - truth * there).head<2>().norm(), 2e-3);
  EXPECT_LT(pose.information(2, 2), 1 / (0.05 * 0.05));  // less than the guess knows
}

TEST(SharedPlanes, ACorridorDoesNotTellThePlace) {
  Pair pair(drift());
  pair.add(kFloor, {2, 0, 0});
  pair.add(kSide, {2, -1, 1});
  EXPECT_FALSE(tells_place(pose_by_shared_planes(pair.graph, pair.a, pair.b, pair.guess())));
  pair.add(kEnd, {4, 0, 1});
  EXPECT_TRUE(tells_place(pose_by_shared_planes(pair.graph, pair.a, pair.b, pair.guess())));
  Pair lines(drift());
  lines.add(kSide, {2, -1, 0.5}, true);
  EXPECT_FALSE(tells_place(pose_by_shared_planes(lines.graph, lines.a, lines.b, lines.guess())));
  lines.add(kEnd, {4, 0, 0.5}, true);
  EXPECT_TRUE(tells_place(pose_by_shared_planes(lines.graph, lines.a, lines.b, lines.guess())));
}

TEST(SharedPlanes, AWrongNameIsSeenAndMovesNothing) {
  Pair pair(drift());
  pair.add(kFloor, {2, 0, 0});
  pair.add(kEnd, {4, 0, 1});
  pair.add(kSide, {2, -1, 1});
  pair.add(Plane({0, -1, 0}, -2), {3, 2, 1});
  const PlaneId pillar = pair.add(Plane({0, 1, 0}, -0.8), {3, -0.8, 1});
  // What b calls the pillar's front is the wall behind it.
  pair.graph.plane_moments.back().moments_body = seen(kSide, {3, -1, 1}, pair.T_map_b);
  const SharedPose pose = pose_by_shared_planes(pair.graph, pair.a, pair.b, pair.guess());
  EXPECT_LT(pair.off(pose.T_a_b).norm(), 5e-3);
  EXPECT_GT(pose.chi_squared, 100);
  EXPECT_EQ(pair.graph.plane_moments.back().plane, pillar);
}

TEST(SharedPlanes, NothingSharedLeavesTheGuess) {
  Pair pair(drift());
  const SharedPose pose = pose_by_shared_planes(pair.graph, pair.a, pair.b, pair.guess());
  EXPECT_EQ(pose.planes, 0);
  EXPECT_EQ(pose.T_a_b.translation(), pair.guess().translation());
}

// There, back and there again along a bare corridor; wheels slip by 40 cm before the last time, and
// loops say so. What left the window until then must follow them.
TEST(Mapper, ASlipThatLoopsTellLeavesNoFrameBehind) {
  const std::vector<made_up::Panel> walls = {{Plane({0, -1, 0}, -1), {5, 1, 1.25}, {10, 1.25}},
                                             {Plane({0, 1, 0}, -1), {5, -1, 1.25}, {10, 1.25}}};
  constexpr int kWay = 40, kSlips = 2 * kWay + 1;
  constexpr double kStep = 0.2;
  Matrix6d C = Matrix6d::Zero();
  C.diagonal() << 4e-4, 4e-4, 1e-8, 1e-8, 1e-8, 1e-5;
  made_up::Sensor sensor(8);
  MapperOptions options;
  options.window.keyframes = 8;
  Mapper mapper(options);
  std::vector<SE3> truth;
  std::vector<std::pair<KeyframeId, SE3>> keyframes;  // and where they are
  for (int i = 0; i <= 3 * kWay; ++i) {
    const int at = i <= kWay ? i : i <= 2 * kWay ? 2 * kWay - i : i - 2 * kWay;
    truth.push_back(SE3::planar(kStep * at, 0, 0));
    SE3 step = i == 0 ? truth[0] : truth[std::size_t(i) - 1].inverse() * truth.back();
    if (i == kSlips) step = step * SE3::planar(0.4, 0, 0);
    const AddResult added =
        mapper.add(sensor.scan(truth.back(), made_up::at_frame(std::size_t(i)), walls), step, C);
    if (added.is_keyframe) keyframes.emplace_back(added.keyframe, truth.back());
  }
  ASSERT_GT(mapper.graph().keyframes.size(), 10U);
  int loops = 0;
  const auto& [first, T_map_first] = keyframes.front();
  for (const auto& [id, T_map_body] : keyframes) {
    loops +=
        mapper.add_loop(first, id, T_map_first.inverse() * T_map_body, 1e-4 * Matrix6d::Identity());
  }
  ASSERT_GT(loops, 5);
  mapper.refine();
  const Trajectory path = mapper.trajectory();
  for (std::size_t i = 0; i < path.size(); ++i) {
    // On the way to the first loop after it nothing says where the slip was.
    if (i > kSlips - 5 && i < kSlips + 10) continue;
    EXPECT_LT((path[i].pose.translation() - truth[i].translation()).norm(), 0.1) << i;
  }
}

// A wall and a panel 20 cm before it, taken for one plane by views from the same keyframes.
TEST(MapperRefine, PlanesThatPartKeepTheOutlinesThatLieOnThem) {
  MapState state;
  const Plane wall({0, 1, 0}, -1), panel({0, 1, 0}, -0.8);
  const PlaneId one = state.graph.add_plane(PlaneLandmark::at(wall, {3, -1, 1}));
  const PlaneId floor = state.graph.add_plane(PlaneLandmark::at(kFloor, {3, 0, 0}));
  const PlaneId end = state.graph.add_plane(PlaneLandmark::at(Plane({-1, 0, 0}, -8), {8, 0, 1}));
  const auto square = [](const Eigen::Vector3d& middle, double half, const SE3& T_map_body) {
    std::vector<Eigen::Vector3d> points;
    for (const auto& [u, v] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
      points.push_back(T_map_body.inverse() *
                       Eigen::Vector3d(middle + half * Eigen::Vector3d(u, 0, v)));
    }
    return points;
  };
  for (int k = 0; k < 12; ++k) {
    const SE3 T = SE3::planar(0.3 * k, 0, 0);
    const KeyframeId id = state.graph.add_keyframe(Timestamp::from_seconds(k), T);
    state.graph.at(id).fixed = k == 0;
    if (k > 0) {
      state.graph.odometry.push_back({state.graph.keyframes[std::size_t(k) - 1].id, id,
                                      SE3::planar(0.3, 0, 0), Matrix6d::Identity() * 1e3});
    }
    state.graph.plane_moments.push_back({id, floor, seen(kFloor, {0.3 * k + 2, 0, 0}, T)});
    state.graph.plane_moments.push_back({id, end, seen(Plane({-1, 0, 0}, -8), {8, 0, 1}, T)});
    state.graph.plane_moments.push_back({id, one, seen(wall, {0.3 * k + 2, -1, 1}, T)});
    state.outlines[one].push_back({id, square({0.3 * k + 2, -1, 1}, 0.5, T)});
    state.frames.push_back({Timestamp::from_seconds(k), id, SE3()});
    if (k < 4 || k > 7) continue;
    state.graph.plane_moments.push_back({id, one, seen(panel, {4, -0.8, 1}, T)});
    state.outlines[one].push_back({id, square({4, -0.8, 1}, 0.4, T)});
  }
  ASSERT_TRUE(state.problems().empty());
  Mapper mapper({}, std::move(state));
  mapper.refine();
  double panel_area = 0, wall_area = 0;
  for (const MapPlane& plane : mapper.map().planes) {
    if (std::abs(plane.plane_map.normal().y()) < 0.9) continue;
    (std::abs(plane.plane_map.rho() + 0.8) < 0.02 ? panel_area : wall_area) += plane.area;
  }
  EXPECT_NEAR(panel_area, 0.64, 0.1);  // 0.8 x 0.8 m
  EXPECT_NEAR(wall_area, 4.5, 0.5);
}

}  // namespace
}  // namespace lamina
