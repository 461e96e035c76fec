// Bytes put aside and read back.
#include <gtest/gtest.h>

#include <filesystem>

#include <lamina/models/error.hpp>
#include <lamina/models/unnamed_file.hpp>

namespace lamina {
namespace {

TEST(UnnamedFile, GivesBackWhatWasAddedAndIsNotSeen) {
  const auto folder = std::filesystem::temp_directory_path() / "lamina_unnamed_file_test";
  std::filesystem::create_directories(folder);
  {
    UnnamedFile file(folder);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
    const std::string zeros("\0\n\0", 3);
    file.append("first");
    file.append(zeros);
    EXPECT_EQ(file.size(), 8u);
    EXPECT_EQ(file.read(0, 5), "first");
    EXPECT_EQ(file.read(5, 3), zeros);
    EXPECT_EQ(file.read(3, 0), "");
    EXPECT_THROW(file.read(5, 4), Error);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove(folder);
}

TEST(UnnamedFile, AFolderThatIsNotThereIsSaid) { EXPECT_THROW(UnnamedFile("/absent"), Error); }

}  // namespace
}  // namespace lamina
