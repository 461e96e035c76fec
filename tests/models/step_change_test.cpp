// One step, drifts, noise and outliers.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/models/step_change.hpp>

namespace lamina {
namespace {

std::vector<double> noise(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<double> values(n);
  for (double& value : values) value = normal(random);
  return values;
}

TEST(StepChange, FindsWhereValuesFallIntoTwo) {
  std::vector<double> values = noise(20, 1);
  for (std::size_t i = 8; i < 20; ++i) values[i] += 8;
  values[3] = 100;  // an accident
  const auto found = find_step(values);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->at, 8);
  EXPECT_NEAR(found->before, 0, 1.5);
  EXPECT_NEAR(found->after, 8, 1.5);
  EXPECT_GT(found->sigmas, 8);
}

TEST(StepChange, NoiseHasNone) {
  int found = 0;
  for (unsigned seed = 1; seed <= 300; ++seed)
    found += find_step(noise(6 + seed % 40, seed)).has_value();
  EXPECT_LE(found, 1);
}

TEST(StepChange, NorHasAVisitElsewhereNorTooFew) {
  std::vector<double> values = noise(30, 2);
  for (std::size_t i = 12; i < 18; ++i) values[i] += 10;
  const auto found = find_step(values);
  EXPECT_FALSE(found && std::abs(found->after - found->before) > 2);
  EXPECT_FALSE(find_step({}));
  EXPECT_FALSE(find_step({0, 0, 0, 9, 9}));
  EXPECT_TRUE(find_step({0, 0, 0, 9, 9, 9}));
}

TEST(StepChange, NumbersMayBeOffByAHalf) {
  std::vector<double> values = noise(30, 3);
  for (std::size_t i = 15; i < 30; ++i) values[i] += 8;
  for (const double k : {0.5, 1.5}) {
    EXPECT_TRUE(find_step(values, {static_cast<std::size_t>(3 * k + 0.5), 6, 2}));
    EXPECT_TRUE(find_step(values, {3, 6 * k, 2}));
    EXPECT_TRUE(find_step(values, {3, 6, 2 * k}));
  }
}

}  // namespace
}  // namespace lamina
