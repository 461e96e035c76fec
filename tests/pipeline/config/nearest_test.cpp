// Hints for misspelt names.
#include <gtest/gtest.h>

#include <lamina/pipeline/config/nearest.hpp>

namespace lamina {
namespace {

TEST(Nearest, FindsTheMisspeltName) {
  const std::vector<std::string> names{"map", "refine", "simulate", "window.keyframes"};
  EXPECT_EQ(nearest("refnie", names), "refine");
  EXPECT_EQ(nearest("mpa", names), "map");
  EXPECT_EQ(nearest("window.keyframe", names), "window.keyframes");
}

TEST(Nearest, GivesNothingWhereNothingIsNear) {
  EXPECT_EQ(nearest("zzzzzzzz", {"map", "refine"}), "");
  EXPECT_EQ(nearest("map", {}), "");
}

}  // namespace
}  // namespace lamina
