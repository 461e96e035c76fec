// Pieces of ground that touch without a step are one floor where the ground swells.
#include <lamina/backend/association/connected_ground.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

using Height = std::function<double(double, double)>;

ConnectedGroundOptions on() {
  ConnectedGroundOptions options;
  options.enabled = true;
  return options;
}

struct View {
  std::vector<PlaneEvidence> evidence;
  std::vector<Moments> patches;
};

// Ground ahead, 0.6 to 3.8 m and 2 m wide, cut every `length` m into pieces.
View view_of(const Height& ground, double length, double noise = 5e-4) {
  std::mt19937 rng(2);
  std::normal_distribution<double> normal(0, noise);
  View view;
  for (double from = 0.6; from < 3.7; from += length) {
    Moments all;
    for (double x = from; x < from + length - 0.05; x += 0.2) {
      for (double y = -1; y < 0.95; y += 0.2) {
        Moments patch;
        for (int k = 0; k < 9; ++k) {
          const double px = x + 0.06 * (k % 3), py = y + 0.06 * (k / 3);
          patch.add({px, py, ground(px, py) + normal(rng)}, 1 / (noise * noise));
        }
        all.merge(patch);
        view.patches.push_back(patch);
      }
    }
    PlaneEvidence& e = view.evidence.emplace_back();
    e.plane_body = all.fit_plane({0, 0, 1}, 1.0)->plane;
    e.moments_body = all;
    e.floor = {0.0005, 0.0005, 0.0005};
    for (const auto& [x, y] : {std::pair(from, -1.0), std::pair(from + length, -1.0),
                               std::pair(from + length, 1.0), std::pair(from, 1.0)}) {
      e.outline_body.push_back(e.plane_body.project({x, y, ground(x, y)}));
    }
    (view.evidence.size() == 1 ? e.votes.floor : e.votes.sub_dominant) = 1;
  }
  return view;
}

double swell(double x, double y) { return 0.008 * std::sin(3.1 * x) + 0.008 * std::sin(4 * y); }

TEST(ConnectedGround, PiecesOfASwellAreOneFloorWithItsRoughness) {
  const View view = view_of(swell, 1.07);
  ASSERT_EQ(view.evidence.size(), 3u);
  const auto ground = connected_ground(view.evidence, view.patches, false, on());
  ASSERT_TRUE(ground);
  EXPECT_EQ(ground->pieces.size(), 3u);
  EXPECT_NEAR(ground->roughness, 0.0085, 0.004);
  ASSERT_TRUE(ground->within_pieces);
  EXPECT_GT(*ground->within_pieces, 0.003);
  GroundWatch watch;
  for (int i = 0; i < 3; ++i) watch.add(ground, on());
  EXPECT_TRUE(watch.swells());
  const PlaneEvidence one = watch.as_one(*ground, on());
  EXPECT_LT(angle_between(one.plane_body, Plane(Eigen::Vector3d::UnitZ(), 0)), 0.02);
  EXPECT_GT(one.floor.sigma_rho, 0.0015);
  std::vector<Eigen::Vector2d> plan;
  for (const auto& p : one.outline_body) plan.push_back(p.head<2>());
  const auto polygon = Polygon::from_vertices(plan);
  ASSERT_TRUE(polygon);
  EXPECT_NEAR(polygon->area(), 6.4, 0.1);
  for (const double x : {1.0, 2.0, 2.6, 3.4}) EXPECT_TRUE(polygon->contains({x, 0.3})) << x;
}

TEST(ConnectedGround, AStepOfTwoCentimetresPartsIt) {
  const View view = view_of([](double x, double) { return x > 2.15 ? 0.02 : 0.0; }, 1.6);
  ASSERT_EQ(view.evidence.size(), 2u);
  const auto ground = connected_ground(view.evidence, view.patches, false, on());
  ASSERT_TRUE(ground);
  EXPECT_EQ(ground->pieces.size(), 1u);
}

TEST(ConnectedGround, ARampTouchesButDoesNotSwell) {
  const View view = view_of([](double x, double) { return std::max(0.0, 0.087 * (x - 2.2)); }, 1.6);
  const auto ground = connected_ground(view.evidence, view.patches, false, on());
  ASSERT_TRUE(ground);
  EXPECT_EQ(ground->pieces.size(), 2u);
  GroundWatch watch;
  for (int i = 0; i < 30; ++i) watch.add(ground, on());
  EXPECT_FALSE(watch.swells());
}

TEST(ConnectedGround, WithoutADominantFloorOnlyWhereItIsAskedFor) {
  View view = view_of(swell, 1.07);
  view.evidence.front().votes = LabelVotes{0, 1, 0};
  EXPECT_FALSE(connected_ground(view.evidence, view.patches, false, on()));
  EXPECT_TRUE(connected_ground(view.evidence, view.patches, true, on()));
  EXPECT_FALSE(connected_ground(view.evidence, std::span(view.patches).first(3), true, on()));
  ConnectedGroundOptions off = on();
  off.enabled = false;
  GroundWatch watch;
  for (int i = 0; i < 30; ++i)
    watch.add(connected_ground(view.evidence, view.patches, true, on()), off);
  EXPECT_FALSE(watch.swells());
}

TEST(ConnectedGround, SwellsUntilItNoLongerDoes) {
  const View rough = view_of(swell, 1.07), flat = view_of([](double, double) { return 0.0; }, 1.6);
  GroundWatch watch;
  const auto see = [&](const View& view, int times) {
    for (int i = 0; i < times; ++i)
      watch.add(connected_ground(view.evidence, view.patches, true, on()), on());
    return watch.swells();
  };
  EXPECT_FALSE(see(flat, 30));
  EXPECT_TRUE(see(rough, 30));
  EXPECT_FALSE(see(flat, 80));
  const Eigen::Vector2d near = watch.lift_variances(0.1, on()), far = watch.lift_variances(3, on());
  EXPECT_LT(near.y(), far.y());
}

}  // namespace
}  // namespace lamina
