// Floor seen again and again takes the room of the floor.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/backend/mapper/surfel_estimator.hpp>

namespace lamina {
namespace {

// A view of 2 x 1 m of level floor ahead, in squares of 0.1 m, to 3 mm.
void see(SurfelEvidence& evidence, const Keyframe& keyframe, std::mt19937& rng) {
  std::normal_distribution<double> noise(0, 0.003);
  for (double x = 1.05; x < 3; x += 0.1) {
    for (double y = -0.45; y < 0.5; y += 0.1) {
      Moments m;
      for (int k = 0; k < 9; ++k) {
        m.add({x + 0.03 * (k % 3 - 1), y + 0.03 * (k / 3 - 1), noise(rng)}, 1e5);
      }
      evidence.add(keyframe.id, m);
    }
  }
}

TEST(SurfelEvidence, AHundredLapsTakeTheRoomOfTwo) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> off(-0.2, 0.2);
  Graph graph;
  SurfelEvidence evidence(0.1);
  std::size_t second = 0;
  for (int lap = 0; lap < 100; ++lap) {
    for (int i = 0; i < 12; ++i) {  // up a corridor, and back
      const double x = i < 6 ? 0.8 * i : 0.8 * (11 - i);
      const KeyframeId id = graph.add_keyframe(
          {}, SE3::planar(x + off(rng), off(rng), (i < 6 ? 0 : M_PI) + off(rng)));
      see(evidence, graph.at(id), rng);
    }
    evidence.condense(graph, evidence.keyframes(), 1);
    if (lap == 1) second = evidence.size();
  }
  EXPECT_LE(static_cast<double>(evidence.size()), 1.6 * static_cast<double>(second));
  // Cells of the map that were seen, and a few that noise put beside them.
  const SurfelFloor floor = evidence.solve(graph, {});
  EXPECT_LE(static_cast<double>(evidence.size()), 1.3 * static_cast<double>(floor.cells().size()));
  double squares = 0;
  for (const auto& [key, cell] : floor.cells()) squares += cell.height * cell.height;
  EXPECT_LT(std::sqrt(squares / static_cast<double>(floor.cells().size())), 0.002);
}

TEST(SurfelEvidence, ReachesAsFarAsTheFarthestSquare) {
  std::mt19937 rng(5);
  Graph graph;
  SurfelEvidence evidence(0.1);
  const KeyframeId id = graph.add_keyframe({}, SE3::planar(7, 3, 1));
  EXPECT_EQ(evidence.reach(id), 0);
  see(evidence, graph.at(id), rng);
  EXPECT_NEAR(evidence.reach(id), std::hypot(2.95, 0.45), 1e-3);
}

TEST(SurfelEvidence, CondensingLosesNoPointAndMovesNone) {
  std::mt19937 rng(4);
  Graph graph;
  SurfelEvidence evidence(0.1);
  for (int i = 0; i < 8; ++i) {
    see(evidence, graph.at(graph.add_keyframe({}, SE3::planar(0.3 * i, 0.05 * i, 0.2 * i))), rng);
  }
  const auto sum = [&](const SurfelEvidence& e) {
    Moments all;
    const SurfelFloor floor = e.solve(graph, {});
    for (const auto& [key, cell] : floor.cells()) all.merge(cell.evidence);
    return all;
  };
  const Moments before = sum(evidence);
  const std::size_t size = evidence.size();
  evidence.condense(graph, evidence.keyframes(), 1);
  const Moments after = sum(evidence);
  EXPECT_LT(evidence.size(), size / 2);
  EXPECT_EQ(after.count(), before.count());
  EXPECT_NEAR(after.weight(), before.weight(), 1e-9 * before.weight());
  EXPECT_LT((after.mean() - before.mean()).norm(), 1e-9);
  EXPECT_LT((after.scatter() - before.scatter()).norm(), 1e-9 * before.scatter().norm());
}

}  // namespace
}  // namespace lamina
