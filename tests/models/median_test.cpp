// The median of few values.
#include <gtest/gtest.h>

#include <lamina/models/median.hpp>

namespace lamina {
namespace {

TEST(Median, IsTheUpperMiddleAndZeroOfNone) {
  EXPECT_EQ(median(std::vector<double>{3, 1, 2}), 2);
  EXPECT_EQ(median(std::vector<double>{4, 1, 2, 3}), 3);
  EXPECT_EQ(median(std::vector<int>{7}), 7);
  EXPECT_EQ(median(std::vector<float>{}), 0);
}

}  // namespace
}  // namespace lamina
