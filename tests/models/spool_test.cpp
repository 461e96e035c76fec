// Lists on disk: what went in comes out, and nothing stays behind.
#include <lamina/models/spool.hpp>

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

std::vector<std::string> all(const Spool& spool) {
  std::vector<std::string> items;
  spool.for_each([&](std::string_view item) { items.emplace_back(item); });
  return items;
}

TEST(Spool, GivesBackWhatItWasGiven) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "lamina_spool";
  std::filesystem::create_directories(folder);
  Spool spool(folder);
  EXPECT_TRUE(all(spool).empty());
  // Longer in all than what is held in memory, items longer than a block of reading among them.
  std::vector<std::string> expected;
  for (int i = 0; i < 3000; ++i) {
    const std::size_t length = i % 1000 == 7 ? 2'500'000 : static_cast<std::size_t>(i % 901);
    expected.emplace_back(length, static_cast<char>('a' + i % 26));
    spool.add(expected.back());
  }
  EXPECT_EQ(spool.size(), 3000u);
  EXPECT_TRUE(all(spool) == expected);
  spool.add("one more");
  expected.emplace_back("one more");
  EXPECT_TRUE(all(spool) == expected);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  spool.clear();
  EXPECT_EQ(spool.size(), 0u);
  EXPECT_TRUE(all(spool).empty());
}

TEST(Spool, SaysWhereItCannotWrite) {
  Spool spool("/nonexistent");
  EXPECT_THROW(spool.add(std::string(2'000'000, 'x')), Error);
}

}  // namespace
}  // namespace lamina::io
