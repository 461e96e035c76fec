// A slab taken for the wall behind it, and the wall for another one behind that.
#include <gtest/gtest.h>

#include <lamina/backend/consistency/shifted_associations.hpp>

namespace lamina {
namespace {

constexpr double kGap = 0.04;  // m: the slab before its wall
constexpr int kFirst = 6, kSecond = 6;
constexpr int kWall = 1, kSlab = 2, kBehind = 3;  // names

SE3 at(double x, double y) { return SE3(SO3(), {x, y, 0}); }

// Two visits of a corridor that saw end wall, floor, a wall at y = -2 and a slab before it. The
// second visit, which lies by the gap aside, called the slab `kWall` and the wall `kBehind`; or
// there are three surfaces, and it saw the two behind. What lies behind counts as seen anywhere.
struct Visits {
  Graph graph;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;
  bool slipped;

  // `between`: 1-sigma of the odometry from the first visit to the second, m and rad.
  Visits(bool names_slipped, double between) : slipped(names_slipped) {
    const std::vector<Plane> planes{Plane({-1, 0, 0}, -9), Plane({0, 1, 0}, -2),
                                    Plane({0, 1, 0}, -2 + kGap), Plane({0, 1, 0}, -2 - kGap),
                                    Plane({0, 0, 1}, 0)};
    for (const Plane& plane : planes) {
      PlaneLandmark landmark;
      landmark.plane_anchor = plane;
      graph.add_plane(landmark);
    }
    for (int k = 0; k < kFirst + kSecond; ++k) add_keyframe(k, 1 / between);
    graph.keyframes.front().fixed = true;
    for (PlaneLandmark& plane : graph.planes) {
      remake_outline(plane, outlines[plane.id], graph, 0.1);
    }
  }

  static SE3 truth(int k) { return at(0.3 * (k % kFirst), 0); }

  void see(int k, int name, const Plane& plane, const Eigen::Vector3d& middle) {
    const SE3 T_body_map = truth(k).inverse();
    const Plane body = T_body_map * plane;
    const Matrix32d B = body.tangent_basis();
    const Eigen::Vector3d c = body.project(T_body_map * middle);
    graph.plane_moments.push_back({KeyframeId(k), PlaneId(name),
                                   Moments(1e5, c, 1e5 * B * B.transpose(), 100),
                                   ExtrinsicsId::kNone, 1.0});
    OutlinePiece piece{KeyframeId(k), {}};
    for (const auto& [u, v] : {std::pair(-0.8, -0.5), {0.8, -0.5}, {0.8, 0.5}, {-0.8, 0.5}}) {
      piece.points_body.push_back(c + B * Eigen::Vector2d(u, v));
    }
    outlines[PlaneId(name)].push_back(piece);
  }

  void add_keyframe(int k, double loose) {
    const bool second = k >= kFirst;
    const KeyframeId id = graph.add_keyframe(
        Timestamp(), at(truth(k).translation().x(), second && slipped ? -kGap : 0));
    see(k, 0, Plane({-1, 0, 0}, -9), {9, 0, 1});
    see(k, 4, Plane({0, 0, 1}, 0), {1, 0, 0});
    const double front = second && !slipped ? -2 : -2 + kGap;
    see(k, second ? kWall : kSlab, Plane({0, 1, 0}, front), {1, front, 1});
    see(k, second ? kBehind : kWall, Plane({0, 1, 0}, front - kGap), {1, front - kGap, 1});
    if (k == 0) return;
    const Matrix6d S = Matrix6d::Identity() * (k == kFirst ? loose : 1000);
    const auto before = static_cast<KeyframeId>(k - 1);
    graph.odometry.push_back({before, id, truth(k - 1).inverse() * truth(k), S});
  }

  std::optional<ShiftedAssociations> update() {
    const RefineResult refined = refine(graph);
    EXPECT_TRUE(refined.rejected.empty());
    return test_shifted_associations(graph, find_shifted_associations(graph, outlines, {}), 11.3,
                                     refined, {}, {});
  }
};

TEST(ShiftedAssociations, RowsAreFoundFromBothEnds) {
  const Visits visits(true, 0.1);
  const auto rows = find_shifted_associations(visits.graph, visits.outlines, {});
  ASSERT_EQ(rows.size(), 2u);
  for (const ShiftedAssociations& row : rows) {
    EXPECT_EQ(row.into, PlaneId(kWall));
    EXPECT_TRUE(row.from == PlaneId(kSlab) || row.from == PlaneId(kBehind));
    EXPECT_EQ(row.views.size(), 6u);
    EXPECT_EQ(row.missed, 12u);
    for (const std::size_t i : row.views) {
      const auto& f = visits.graph.plane_moments[i];
      EXPECT_EQ(f.plane, PlaneId(kWall));
      EXPECT_EQ(f.keyframe >= KeyframeId(kFirst), row.from == PlaneId(kBehind));
    }
  }
}

TEST(ShiftedAssociations, ASlabTakenForItsWallGetsItsNameBack) {
  Visits visits(true, 0.1);
  const auto reconsidered = visits.update();
  ASSERT_TRUE(reconsidered.has_value());
  visits.graph.merge_planes(reconsidered->from, reconsidered->into);
  for (int k = 0; k < kFirst + kSecond; ++k) {
    const SE3 off = Visits::truth(k).inverse() * visits.graph.at(KeyframeId(k)).T_map_body;
    EXPECT_LT(off.translation().norm(), 1e-3) << k;
  }
  // One name for what stands in front in either visit, another for what stands behind.
  std::map<bool, std::set<PlaneId>> names;
  for (const auto& f : visits.graph.plane_moments) {
    if (f.plane == PlaneId(0) || f.plane == PlaneId(4)) continue;
    EXPECT_GE(f.weight, 0.5);
    names[f.moments_body.mean().y() > -2 + kGap / 2].insert(f.plane);
  }
  EXPECT_EQ(names[true].size(), 1u);
  EXPECT_EQ(names[false].size(), 1u);
  EXPECT_NE(names[true], names[false]);
}

TEST(ShiftedAssociations, ThreeSurfacesStayWhereOdometryKnowsBetter) {
  Visits visits(false, 0.004);
  const Graph before = visits.graph;
  EXPECT_FALSE(visits.update().has_value());
  for (std::size_t i = 0; i < before.plane_moments.size(); ++i) {
    EXPECT_EQ(visits.graph.plane_moments[i].plane, before.plane_moments[i].plane);
    EXPECT_EQ(visits.graph.plane_moments[i].weight, 1);
  }
}

TEST(ShiftedAssociations, UnequalDistancesAreNoRow) {
  Visits visits(false, 0.1);
  for (auto& f : visits.graph.plane_moments) {
    if (f.plane != PlaneId(kBehind)) continue;
    f.moments_body = f.moments_body.transformed(SE3::from_translation({0, -kGap, 0}));
  }
  EXPECT_TRUE(find_shifted_associations(visits.graph, visits.outlines, {}).empty());
}

}  // namespace
}  // namespace lamina
