// Lists whose lines come twice.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include <lamina/sensors/readers/repeated_images.hpp>

namespace lamina {
namespace {

TEST(RepeatedImages, OneStampAndTheSameBytesAreOneImage) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "repeated_images";
  std::filesystem::create_directories(folder);
  for (const auto& [name, bytes] : {std::pair("a", "one"), {"b", "one"}, {"c", "two"}})
    std::ofstream(folder / name) << bytes;
  std::int64_t repeats = 0;
  const std::string text = "# list\n1 a\n1 b\n1 a\n2 b\n2 c\n3 c\n3 absent\n";
  EXPECT_EQ(without_repeated_images(text, folder, repeats),
            "# list\n1 a\n# b\n# a\n2 b\n2 c\n3 c\n3 absent\n");
  EXPECT_EQ(repeats, 2);
}

}  // namespace
}  // namespace lamina
