// Errors that last for seconds: what is not there is not adopted, what is there mostly is.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/models/adoption.hpp>
#include <lamina/models/block_evidence.hpp>

namespace lamina {
namespace {

// One parameter over 80 s at 5 Hz, half of whose errors last for 3 s; 3 % are gross outliers.
BlockEvidence<1> evidence(double truth, unsigned seed, double seconds = 80) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  BlockEvidence<1> result;
  const double a = std::exp(-1 / 15.0);
  double slow = 0;
  for (int i = 0; i < 5 * seconds; ++i) {
    const double t = 0.2 * i, x = std::sin(2 * M_PI * t / 7) + 0.3 * normal(rng);
    slow = a * slow + std::sqrt(1 - a * a) * normal(rng);
    double y = truth * x + slow + normal(rng);
    if (uniform(rng) < 0.03) y += 15 * normal(rng);
    result.add(Timestamp::from_seconds(1000 + t), BlockEvidence<1>::Vector(x), y, 1);
  }
  return result;
}

const BlockEvidence<1>::Vector kPrior(1.0);

TEST(Adoption, WhatIsNotThereIsNotAdopted) {
  int adopted = 0;
  for (unsigned seed = 0; seed < 40; ++seed)
    adopted += evidence(0, seed).solve(kPrior, {0})->adoption.adopted;
  EXPECT_LE(adopted, 1);
}

TEST(Adoption, WhatIsThereMostlyIs) {
  int adopted = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto found = evidence(1, 500 + seed).solve(kPrior, {0});
    adopted += found->adoption.adopted;
    EXPECT_NEAR(found->value(0), 1, 0.8);
  }
  EXPECT_GE(adopted, 12);
}

TEST(Adoption, FewBlocksAdoptNothing) {
  const auto found = evidence(3, 1, 26).solve(kPrior, {0});
  EXPECT_LT(found->adoption.blocks, 8);
  EXPECT_GT(found->adoption.gain, 9);
  EXPECT_FALSE(found->adoption.adopted);
}

TEST(Adoption, OneBlockThatGainsDoesNotOutweighTheOthers) {
  std::vector<double> gains(20, -0.1);
  gains[3] = 50;
  EXPECT_FALSE(judge(gains).adopted);
  for (double& gain : gains) gain = 2 + 0.1 * gain;
  EXPECT_TRUE(judge(gains).adopted);
}

TEST(Adoption, QuantilesOfStudent) {
  EXPECT_NEAR(student_quantile(1e9), 3, 1e-3);
  EXPECT_NEAR(student_quantile(10), 3.96, 0.05);
  EXPECT_NEAR(student_quantile(20), 3.42, 0.02);
}

// What is free under the stated values, too, neither suggests nor hides the rest.
TEST(Adoption, WhatIsFreeBesideIsNoGain) {
  std::mt19937 rng(3);
  std::normal_distribution<double> normal(0, 1);
  BlockEvidence<2> both;
  for (int i = 0; i < 600; ++i) {
    const Eigen::Vector2d row(normal(rng), normal(rng));
    both.add(Timestamp::from_seconds(1000 + 0.1 * i), row, 2 * row.x() + normal(rng), 1);
  }
  const Eigen::Vector2d prior(10, 10);
  EXPECT_FALSE(both.solve(prior, {1}, {0})->adoption.adopted);
  EXPECT_TRUE(both.solve(prior, {0}, {1})->adoption.adopted);
  EXPECT_NEAR(both.solve(prior, {0}, {1})->value(0), 2, 0.3);
}

// Of a dozen maps, each of which says (2, 0) to 0.3, and one that says (9, 0).
TEST(Adoption, BlocksOfMapsAreJudgedAlike) {
  std::mt19937 rng(5);
  std::normal_distribution<double> normal(0, 1);
  const Eigen::Matrix2d held = 1e12 * Eigen::Matrix2d::Identity();
  Eigen::Matrix2d first = held, second = held;
  first(0, 0) = second(1, 1) = 1e-2;
  std::vector<QuadraticBlock> blocks;
  for (int k = 0; k < 12; ++k) {
    const Eigen::Matrix2d H = Eigen::Matrix2d::Identity() / 0.09;
    const Eigen::Vector2d p((k == 4 ? 9 : 2) + 0.3 * normal(rng), 0.3 * normal(rng));
    blocks.push_back({H, H * p});
  }
  const JudgedBlocks found = judge(blocks, held, first);
  EXPECT_TRUE(found.adoption.adopted);
  EXPECT_NEAR(found.value(0), 2.5, 0.5);
  EXPECT_FALSE(judge(blocks, held, second).adoption.adopted);
  EXPECT_FALSE(judge({}, held, first).adoption.adopted);
}

TEST(Adoption, BlocksAreNumberedAsTheyAreMet) {
  Blocks blocks;
  const auto at = [](double s) { return Timestamp::from_seconds(1000 + s); };
  EXPECT_EQ(blocks.of(at(0)), 0);
  EXPECT_EQ(blocks.of(at(3.9)), 0);
  EXPECT_EQ(blocks.of(at(9)), 1);
  EXPECT_EQ(blocks.of(at(1)), 0);
  EXPECT_EQ(blocks.count(), 2);
}

}  // namespace
}  // namespace lamina
