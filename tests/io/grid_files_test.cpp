// Grids go to files and back.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <lamina/io/grid_files.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

class GridFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() / (std::string("lamina_grid_") +
                                     testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

NavigabilityGrid small_grid() {
  NavigabilityGrid grid(0.05);
  grid.at_or_new({-3, 100}) = {0.125f, 0.01f, 1.0f, 0.9f};
  grid.at_or_new({80, -7}) = {-0.5f, 0.5f, 0.25f, 0.8f};
  grid.at_or_new({0, 0}) = {0.0f, 0.0f, 0.0f, 1.0f};
  return grid;
}

TEST_F(GridFiles, LayersReadBackExactly) {
  write_grid(folder_ / "grid", small_grid());
  const GridImages images = read_grid(folder_ / "grid");
  EXPECT_EQ(images.geometry.width, 84);
  EXPECT_EQ(images.geometry.height, 108);
  EXPECT_EQ(images.geometry.first, (CellIndex{-3, -7}));
  // Row 0 is the largest y.
  EXPECT_EQ(images.height[0], 0.125f);
  const NavigabilityGrid back = to_grid(images);
  EXPECT_EQ(back.find({80, -7})->navigability, 0.25f);
  EXPECT_EQ(back.find({80, -7})->height, -0.5f);
  EXPECT_FALSE(back.find({1, 1})->known());
}

TEST_F(GridFiles, AnEmptyGridIsOneUnknownCell) {
  write_grid(folder_ / "grid", NavigabilityGrid(0.1));
  const GridImages images = read_grid(folder_ / "grid");
  ASSERT_EQ(images.navigability.size(), 1u);
  EXPECT_TRUE(std::isnan(images.navigability[0]));
}

TEST_F(GridFiles, SaysWhichFileIsDamaged) {
  write_grid(folder_ / "grid", small_grid());
  std::ofstream(folder_ / "grid" / "slope.tiff") << "no image";
  try {
    read_grid(folder_ / "grid");
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("slope.tiff"), std::string::npos);
  }
  EXPECT_THROW(read_grid(folder_), Error);
}

TEST_F(GridFiles, OccupancyUsesTheThreeValuesOfMapServer) {
  const GridGeometry g{0.1, {0, 0}, 2, 2};
  write_occupancy_map(folder_, g, {0.9f, 0.1f, NAN, 0.5f});
  std::ifstream in(folder_ / "occupancy.pgm", std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), std::string("P5\n2 2\n255\n") + '\0' + "\xFE\xCD\xCD");
}

}  // namespace
}  // namespace lamina::io
