// Grids go to files and back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <lamina/io/grid_files.hpp>
#include <lamina/io/image_files.hpp>
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
  const WrittenGrid written = read_grid(folder_ / "grid");
  EXPECT_EQ(written.geometry.width, 84);
  EXPECT_EQ(written.geometry.height, 108);
  EXPECT_EQ(written.geometry.first, (CellIndex{-3, -7}));
  const NavigabilityGrid& back = written.grid;
  EXPECT_EQ(back.find({-3, 100})->height, 0.125f);
  EXPECT_EQ(back.find({80, -7})->navigability, 0.25f);
  EXPECT_EQ(back.find({80, -7})->height, -0.5f);
  EXPECT_EQ(back.find({80, -7})->slope, 0.5f);
  EXPECT_EQ(back.find({80, -7})->confidence, 0.8f);
  EXPECT_FALSE(back.find({1, 1})->known());
}

TEST_F(GridFiles, RowZeroIsAtTheLargestY) {
  write_grid(folder_ / "grid", small_grid());
  std::vector<float> first;
  read_float_tiff(folder_ / "grid" / "height.tiff", 84, 108, [&](int y, const float* row) {
    if (y == 0) first.assign(row, row + 84);
  });
  EXPECT_EQ(first.at(0), 0.125f);
  EXPECT_TRUE(std::isnan(first.at(1)));
}

TEST_F(GridFiles, AnEmptyGridIsOneUnknownCell) {
  write_grid(folder_ / "grid", NavigabilityGrid(0.1));
  const WrittenGrid written = read_grid(folder_ / "grid");
  EXPECT_EQ(written.geometry.width, 1);
  EXPECT_EQ(written.geometry.height, 1);
  EXPECT_TRUE(written.grid.empty());
}

// Half a kilometre square: files of 1e8 cells, of which three were seen.
TEST_F(GridFiles, RowsOfAWideGridAreThoseOfItsTiles) {
  NavigabilityGrid grid(0.05);
  grid.at_or_new({0, 0}).navigability = 1;
  grid.at_or_new({9999, 9999}).navigability = 0;
  grid.at_or_new({5000, 63}).navigability = 0.5f;
  const GridGeometry g = known_bounds(grid);
  std::vector<float> row(static_cast<std::size_t>(g.width));
  const auto at = [&](const CellIndex& c) {
    layer_row(grid, g, g.height - 1 - c.j, &NavigabilityCell::navigability, row.data());
    return row[static_cast<std::size_t>(c.i)];
  };
  EXPECT_EQ(at({0, 0}), 1);
  EXPECT_EQ(at({9999, 9999}), 0);
  EXPECT_EQ(at({5000, 63}), 0.5f);
  EXPECT_TRUE(std::isnan(at({5000, 64})));
  EXPECT_EQ(std::count_if(row.begin(), row.end(), [](float x) { return !std::isnan(x); }), 0);
}

TEST_F(GridFiles, LayersSayWhereTheyLie) {
  write_grid(folder_ / "grid", small_grid());
  std::stringstream text;
  text << std::ifstream(folder_ / "grid" / "height.tiff", std::ios::binary).rdbuf();
  const double tie[] = {0, 0, 0, -3 * 0.05, 101 * 0.05, 0}, scale[] = {0.05, 0.05, 0};
  const auto holds = [&](const double* values, std::size_t n) {
    return text.str().find(std::string(reinterpret_cast<const char*>(values), 8 * n)) !=
           std::string::npos;
  };
  EXPECT_TRUE(holds(scale, 3));
  EXPECT_TRUE(holds(tie, 6));
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
  const float values[] = {0.9f, 0.1f, NAN, 0.5f};
  write_occupancy_map(folder_, g,
                      [&](int row, float* out) { std::copy_n(values + 2 * row, 2, out); });
  std::ifstream in(folder_ / "occupancy.pgm", std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), std::string("P5\n2 2\n255\n") + '\0' + "\xFE\xCD\xCD");
}

}  // namespace
}  // namespace lamina::io
