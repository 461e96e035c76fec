// Sub-sections: their count, borders and order.
#include <gtest/gtest.h>

#include <lamina/frontend/depth/sections.hpp>

namespace lamina {
namespace {

TEST(Sections, CoverTheRegionOfInterestAndNothingElse) {
  const SectionGrid grid{FloorOptions()};
  EXPECT_EQ(grid.count(), 12);
  EXPECT_EQ(grid.section_of({0.1, 0, 0}), 1);
  EXPECT_EQ(grid.section_of({4.8, 1.9, 0.2}), 11);
  EXPECT_EQ(grid.section_of({5.0, 0, 0}), -1);
  EXPECT_EQ(grid.section_of({1.0, 2.1, 0}), -1);
  EXPECT_EQ(grid.section_of({1.0, 0, 0.8}), -1);
  EXPECT_EQ(grid.section_of({-0.1, 0, 0}), -1);
}

TEST(Sections, NearOnesComeFirst) {
  for (const auto& shape : {std::array{3, 2}, std::array{4, 3}, std::array{12, 9}}) {
    FloorOptions options;
    options.sections = shape;
    const SectionGrid grid(options);
    ASSERT_EQ(grid.by_priority().size(), static_cast<std::size_t>(shape[0] * shape[1]));
    EXPECT_EQ(grid.coordinates(grid.by_priority().front()).first, 0);
    EXPECT_EQ(grid.coordinates(grid.by_priority().back()).first, shape[0] - 1);
  }
}

TEST(FloorOptions, ProblemsAreNamed) {
  EXPECT_TRUE(FloorOptions().problems().empty());
  FloorOptions bad;
  bad.sections = {0, 3};
  bad.roi_m = {4.9, -1, 0.75};
  bad.false_alarm = 0;
  EXPECT_EQ(bad.problems().size(), 3u);
}

}  // namespace
}  // namespace lamina
