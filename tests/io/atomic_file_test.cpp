// Files appear whole or not at all.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include <lamina/io/atomic_file.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

class AtomicFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() /
        (std::string("lamina_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    make_output_folder(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(AtomicFile, ReplacesTheOldContentAndLeavesNothingBeside) {
  const fs::path file = folder_ / "a.txt";
  write_atomically(file, "old");
  write_atomically(file, "new");
  EXPECT_EQ(content_of(file), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(AtomicFile, KeepsTheOldFileWhenTheWriterThrows) {
  const fs::path file = folder_ / "a.txt";
  write_atomically(file, "old");
  EXPECT_THROW(write_atomically(file,
                                [](std::ostream& out) {
                                  out << "half";
                                  throw std::runtime_error("stop");
                                }),
               std::runtime_error);
  EXPECT_EQ(content_of(file), "old");
}

TEST_F(AtomicFile, NamesTheFileThatCannotBeWritten) {
  try {
    write_atomically(folder_ / "none" / "a.txt", "x");
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("none/a.txt"), std::string::npos);
  }
}

TEST_F(AtomicFile, RefusesAFolderWhereAFileStands) {
  write_atomically(folder_ / "a", "x");
  EXPECT_THROW(make_output_folder(folder_ / "a"), Error);
}

}  // namespace
}  // namespace lamina::io
