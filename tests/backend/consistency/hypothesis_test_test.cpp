// Planes that stand twice because a wrong name holds a stretch of the path.
#include <gtest/gtest.h>

#include <lamina/backend/consistency/hypothesis_test.hpp>

namespace lamina {
namespace {

constexpr double kShift = 0.04;  // m: a slab before its wall
constexpr int kFirst = 6, kSecond = 6;

SE3 at(double x, double y) { return SE3(SO3(), {x, y, 0}); }

// Two visits of a room that saw the left wall, a slab 4 cm before the right wall, the end wall and
// the floor. `names_wrong`: the second visit took the slab for the right wall behind it, so that
// it lies 4 cm aside and the left wall, as plane 4, stands twice. Otherwise plane 4 is a panel.
struct Visits {
  Graph graph;
  std::vector<Plane> planes{
      Plane({0, -1, 0}, -2.0),           // left wall
      Plane({0, 1, 0}, -2.0),            // right wall
      Plane({-1, 0, 0}, -9.0),           // end wall
      Plane({0, 0, 1}, 0.0),             // floor
      Plane({0, -1, 0}, -2.0 + kShift),  // left wall as the second visit has it
      Plane({0, 1, 0}, -2.0 + kShift)};  // slab
  bool names_wrong;

  explicit Visits(bool wrong) : names_wrong(wrong) {
    for (const Plane& plane : planes) {
      PlaneLandmark landmark;
      landmark.plane_anchor = plane;
      graph.add_plane(landmark);
    }
    for (int k = 0; k < kFirst + kSecond; ++k) add_keyframe(k);
    graph.keyframes.front().fixed = true;
  }

  static SE3 truth(int k) { return at(k % kFirst, 0); }

  void see(int k, int name, const Plane& plane) {
    const Plane body = truth(k).inverse() * plane;
    const Matrix32d B = body.tangent_basis();
    graph.plane_moments.push_back(
        {KeyframeId(k), PlaneId(name),
         Moments(1e5, body.project(Eigen::Vector3d::Zero()), 1e5 * B * B.transpose(), 100),
         ExtrinsicsId::kNone, 1.0});
  }

  void add_keyframe(int k) {
    const bool second = k >= kFirst;
    const bool aside = second && names_wrong;
    const SE3 start = at(truth(k).translation().x(), aside ? -kShift : 0);
    const KeyframeId id = graph.add_keyframe(Timestamp(), start);
    for (const int plane : {2, 3}) see(k, plane, planes[static_cast<std::size_t>(plane)]);
    if (!second) {
      see(k, 0, planes[0]);
      see(k, 1, planes[1]);
      see(k, 5, planes[5]);
    } else {
      see(k, 4, names_wrong ? planes[0] : planes[4]);
      if (!names_wrong) see(k, 1, planes[1]);
      if (names_wrong && k < kFirst + 2) see(k, 1, planes[5]);  // one side of the way alone
    }
    if (k == 0) return;
    // Much happened between the visits.
    const Matrix6d S = Matrix6d::Identity() * (k == kFirst ? 2 : 100);
    const auto before = static_cast<KeyframeId>(k - 1);
    graph.odometry.push_back({before, id, truth(k - 1).inverse() * truth(k), S});
  }

  double worst() const {
    double worst = 0;
    for (int k = 0; k < kFirst + kSecond; ++k) {
      const SE3 off = truth(k).inverse() * graph.at(KeyframeId(k)).T_map_body;
      worst = std::max(worst, off.translation().norm());
    }
    return worst;
  }
};

using Pairs = std::vector<std::pair<PlaneId, PlaneId>>;
const Pairs kLeftWall{{PlaneId(4), PlaneId(0)}};

TEST(MergeHearing, AStretchHeldByAWrongNameComesBack) {
  Visits visits(true);
  const RefineResult refined = refine(visits.graph);
  ASSERT_TRUE(refined.rejected.empty());       // nothing contradicts it but that walls are not seen
  ASSERT_NEAR(visits.worst(), kShift, 0.005);  // through
  EXPECT_EQ(test_merge_hypotheses(visits.graph, kLeftWall, refined, {}, {}), kLeftWall);
  EXPECT_LT(visits.worst(), 0.005);
  int rejected = 0;
  for (const auto& f : visits.graph.plane_moments) {
    if (f.weight >= 0.5) continue;
    ++rejected;
    EXPECT_EQ(f.plane, PlaneId(1));
    EXPECT_GE(f.keyframe, KeyframeId(kFirst));
  }
  EXPECT_EQ(rejected, 2);
  EXPECT_TRUE(visits.graph.at(PlaneId(4)).active);  // merging is the caller's
}

TEST(MergeHearing, APanelThatWasPutUpStays) {
  Visits visits(false);
  const RefineResult refined = refine(visits.graph);
  ASSERT_LT(visits.worst(), 0.005);
  const Graph before = visits.graph;
  EXPECT_TRUE(test_merge_hypotheses(visits.graph, kLeftWall, refined, {}, {}).empty());
  for (std::size_t i = 0; i < before.plane_moments.size(); ++i) {
    EXPECT_EQ(visits.graph.plane_moments[i].weight, before.plane_moments[i].weight);
    EXPECT_EQ(visits.graph.plane_moments[i].plane, before.plane_moments[i].plane);
  }
  for (std::size_t k = 0; k < before.keyframes.size(); ++k) {
    EXPECT_EQ(visits.graph.keyframes[k].T_map_body.translation(),
              before.keyframes[k].T_map_body.translation());
  }
}

TEST(MergeHearing, NoPairsNoSolve) {
  Visits visits(true);
  const RefineResult refined = refine(visits.graph);
  int asked = 0;
  EXPECT_TRUE(test_merge_hypotheses(visits.graph, {}, refined, {}, [&](const RefineProgress&) {
                ++asked;
                return true;
              }).empty());
  EXPECT_EQ(asked, 0);
}

}  // namespace
}  // namespace lamina
