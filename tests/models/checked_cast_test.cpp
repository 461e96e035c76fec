// Numbers that are no indices become the nearest that is.
#include <gmock/gmock.h>

#include <limits>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(CheckedCast, IndicesStayWithinTheirRange) {
  EXPECT_EQ(to_index(3.9, 10), 3u);
  EXPECT_EQ(to_index(10.5, 10), 10u);
  for (const double x : {-1e-9, -3.0, -1e300, -kInf, kNan}) EXPECT_EQ(to_index(x, 10), 0u) << x;
  for (const double x : {11.0, 1e300, kInf}) EXPECT_EQ(to_index(x, 10), 10u) << x;
}

TEST(CheckedCast, CellsRoundDownAndHaveNeighbours) {
  EXPECT_EQ(to_cell(2.5), 2);
  EXPECT_EQ(to_cell(-2.5), -3);
  EXPECT_EQ(to_cell(-2.0), -2);
  for (const double x : {1e18, kInf}) EXPECT_EQ(to_cell(x), 1 << 30);
  for (const double x : {-1e18, -kInf, kNan}) EXPECT_EQ(to_cell(x), -(1 << 30));
  EXPECT_EQ(to_far_cell(-1e10 - 0.5), -10'000'000'001);
  EXPECT_EQ(to_far_cell(kInf), std::int64_t{1} << 62);
}

TEST(CheckedCast, WholeNumbersOfAnyRange) {
  EXPECT_EQ(to_whole(-7.9, -5, 5), -5);
  EXPECT_EQ(to_whole(-4.9, -5, 5), -4);
  EXPECT_EQ(to_whole(kNan, 4, 64), 4);
}

}  // namespace
}  // namespace lamina
