// Assignment against brute force.
#include <gtest/gtest.h>

#include <lamina/frontend/segments/assignment.hpp>
#include <random>

namespace lamina {
namespace {

double total(const std::vector<int>& result, const std::vector<std::vector<double>>& cost,
             double unmatched) {
  double sum = 0;
  for (std::size_t i = 0; i < result.size(); ++i) {
    sum += result[i] < 0 ? unmatched : cost[i][static_cast<std::size_t>(result[i])];
  }
  return sum;
}

double brute(const std::vector<std::vector<double>>& cost, std::size_t row, unsigned used,
             double unmatched) {
  if (row == cost.size()) return 0;
  double best = unmatched + brute(cost, row + 1, used, unmatched);
  for (std::size_t j = 0; j < cost[row].size(); ++j) {
    if ((used >> j & 1U) != 0 || cost[row][j] >= unmatched) continue;
    best = std::min(best, cost[row][j] + brute(cost, row + 1, used | 1U << j, unmatched));
  }
  return best;
}

TEST(Assignment, IsTheGloballyBest) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit;
  for (int k = 0; k < 200; ++k) {
    const int rows = 1 + k % 6, columns = 1 + (k / 6) % 6;
    std::vector<std::vector<double>> cost(static_cast<std::size_t>(rows));
    std::vector<AssignmentCandidate> candidates;
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j) {
        const double c = unit(random) < 0.4 ? 100 : 12 * unit(random);
        cost[static_cast<std::size_t>(i)].push_back(c);
        if (c < 100) candidates.push_back({i, j, c});
      }
    }
    const std::vector<int> result = assign(rows, columns, candidates, 10);
    std::vector<int> seen;
    for (const int j : result) {
      if (j < 0) continue;
      EXPECT_EQ(std::count(seen.begin(), seen.end(), j), 0);
      seen.push_back(j);
    }
    EXPECT_NEAR(total(result, cost, 10), brute(cost, 0, 0, 10), 1e-9) << k;
  }
}

TEST(Assignment, NothingToAssign) {
  EXPECT_TRUE(assign(0, 3, {}, 1).empty());
  EXPECT_EQ(assign(2, 0, {}, 1), (std::vector<int>{-1, -1}));
}

TEST(Assignment, TheBestPairIsGivenUpWhenTheTotalGains) {
  // First come, first served would take (0, 0) at 1 and leave row 1 alone.
  EXPECT_EQ(assign(2, 2, {{0, 0, 1}, {0, 1, 2}, {1, 0, 1.5}}, 10), (std::vector<int>{1, 0}));
}

}  // namespace
}  // namespace lamina
