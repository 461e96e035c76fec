// map.png by the rules of those who read it: nav2 [Nav2] and ROS 1 [MapServer], in every mode that
// map.yaml may be set to by hand.
#include <gtest/gtest.h>
#include <png.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <lamina/io/grid_files.hpp>

namespace lamina::io {
namespace {

namespace fs = std::filesystem;
constexpr int kUnknown = -1, kFree = 0, kOccupied = 100;

struct MapImage {
  int width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> pixels;
  double occupied = 0, free = 0;
  std::string mode;

  const std::uint8_t* at(int x, int y) const {
    return pixels.data() + static_cast<std::ptrdiff_t>((y * width + x) * channels);
  }
};

// Channels as they are in the file: SDL and GraphicsMagick leave RGBA as it is.
MapImage read_map(const fs::path& folder) {
  const YAML::Node yaml = YAML::LoadFile((folder / "map.yaml").string());
  MapImage map;
  map.occupied = yaml["occupied_thresh"].as<double>();
  map.free = yaml["free_thresh"].as<double>();
  map.mode = yaml["mode"].as<std::string>();
  EXPECT_EQ(yaml["negate"].as<int>(), 0);
  EXPECT_EQ(yaml["origin"].size(), 3U);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(
      png_image_begin_read_from_file(&image, (folder / yaml["image"].as<std::string>()).c_str()));
  map.width = static_cast<int>(image.width);
  map.height = static_cast<int>(image.height);
  map.channels = static_cast<int>(PNG_IMAGE_SAMPLE_CHANNELS(image.format));
  map.pixels.resize(PNG_IMAGE_SIZE(image));
  EXPECT_TRUE(png_image_finish_read(&image, nullptr, map.pixels.data(), 0, nullptr));
  return map;
}

double mean(const std::uint8_t* pixel, int channels) {
  double sum = 0;
  for (int k = 0; k < channels; ++k) sum += pixel[k];
  return sum / channels;
}

// nav2_map_server: what is not opaque is unknown before its colour is asked for.
int nav2_scale(const MapImage& map, const std::uint8_t* pixel) {
  if (map.channels % 2 == 0 && pixel[map.channels - 1] != 255) return kUnknown;
  const double occupied = 1 - mean(pixel, 3) / 255;
  if (occupied > map.occupied) return kOccupied;
  if (occupied < map.free) return kFree;
  return static_cast<int>(std::rint((occupied - map.free) / (map.occupied - map.free) * 100));
}

// map_server of ROS 1: the colour alone where it is beyond a threshold, then alpha.
int ros1_scale(const MapImage& map, const std::uint8_t* pixel) {
  const double occupied = (255 - mean(pixel, map.channels - 1)) / 255;
  if (occupied > map.occupied) return kOccupied;
  if (occupied < map.free) return kFree;
  if (pixel[map.channels - 1] < 1) return kUnknown;
  return static_cast<int>(1 + 98 * (occupied - map.free) / (map.occupied - map.free));
}

// Both, where map.yaml was set to trinary: alpha is averaged in with the colours.
int trinary(const MapImage& map, const std::uint8_t* pixel) {
  const double occupied = 1 - mean(pixel, map.channels) / 255;
  return occupied > map.occupied ? kOccupied : occupied < map.free ? kFree : kUnknown;
}

class MapServer : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() / (std::string("lamina_map_server_") +
                                     testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    NavigabilityGrid grid(0.05);
    grid.at_or_new({0, 0}) = {0, 0, 1.0F, 1};  // free
    grid.at_or_new({2, 0}) = {0, 0, 0.0F, 1};  // blocked
    grid.at_or_new({3, 1}) = {0, 0, 0.5F, 1};  // between
    grid.at_or_new({0, 1}).height = 0.25F;     // seen, its navigability unknown
    write_navigability_map(folder_, grid);
    map_ = read_map(folder_);
    ASSERT_EQ(map_.width, 4);
    ASSERT_EQ(map_.height, 2);
    ASSERT_EQ(map_.mode, "scale");
    ASSERT_EQ(map_.channels, 4) << "RGBA: readers of grey and alpha take alpha for a colour";
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
  MapImage map_;
};

TEST_F(MapServer, Nav2ReadsEveryCellRight) {
  EXPECT_EQ(nav2_scale(map_, map_.at(0, 1)), kFree);
  EXPECT_EQ(nav2_scale(map_, map_.at(2, 1)), kOccupied);
  EXPECT_NEAR(nav2_scale(map_, map_.at(3, 0)), (0.5 - 0.196) / (0.65 - 0.196) * 100, 1);
  EXPECT_EQ(nav2_scale(map_, map_.at(0, 0)), kUnknown);
  EXPECT_EQ(nav2_scale(map_, map_.at(1, 1)), kUnknown);
}

TEST_F(MapServer, Ros1ReadsEveryCellRight) {
  EXPECT_EQ(ros1_scale(map_, map_.at(0, 1)), kFree);
  EXPECT_EQ(ros1_scale(map_, map_.at(2, 1)), kOccupied);
  EXPECT_NEAR(ros1_scale(map_, map_.at(3, 0)), (0.5 - 0.196) / (0.65 - 0.196) * 100, 2);
  EXPECT_EQ(ros1_scale(map_, map_.at(0, 0)), kUnknown);
  EXPECT_EQ(ros1_scale(map_, map_.at(1, 1)), kUnknown);
}

TEST_F(MapServer, SetToTrinaryNothingIsReadWrong) {
  EXPECT_EQ(trinary(map_, map_.at(0, 1)), kFree);
  EXPECT_EQ(trinary(map_, map_.at(2, 1)), kOccupied);
  EXPECT_EQ(trinary(map_, map_.at(3, 0)), kUnknown) << "between the thresholds";
  EXPECT_EQ(trinary(map_, map_.at(0, 0)), kUnknown);
  EXPECT_EQ(trinary(map_, map_.at(1, 1)), kUnknown);
}

// The rule that the grey of unknown cells is for: black under alpha 0 is an obstacle to ROS 1.
TEST_F(MapServer, BlackUnderAlphaZeroIsAnObstacleToRos1) {
  const std::array<std::uint8_t, 4> black{0, 0, 0, 0};
  EXPECT_EQ(ros1_scale(map_, black.data()), kOccupied);
  EXPECT_EQ(nav2_scale(map_, black.data()), kUnknown);
}

// Of a filter's mask, mode raw: nav2 takes a pixel up to 100 as the cell's value, and row 0 of the
// image is the highest of the grid.
std::vector<int> nav2_raw_mask(const fs::path& folder, const std::string& name) {
  const YAML::Node yaml = YAML::LoadFile((folder / (name + ".yaml")).string());
  EXPECT_EQ(yaml["mode"].as<std::string>(), "raw");
  EXPECT_EQ(yaml["negate"].as<int>(), 0);
  EXPECT_EQ(yaml["origin"][0].as<double>(), -0.05);
  EXPECT_EQ(yaml["origin"][1].as<double>(), 0.1);
  EXPECT_EQ(yaml["resolution"].as<double>(), 0.05);
  EXPECT_LT(yaml["free_thresh"].as<double>(), yaml["occupied_thresh"].as<double>());
  std::ifstream file(folder / yaml["image"].as<std::string>(), std::ios::binary);
  std::string magic;
  int width = 0, height = 0, most = 0;
  file >> magic >> width >> height >> most;
  EXPECT_EQ(magic, "P5");
  EXPECT_EQ(most, 255);
  EXPECT_EQ(file.get(), '\n');
  std::vector<int> cells(static_cast<std::size_t>(width * height), -2);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int pixel = file.get();
      cells[static_cast<std::size_t>(width * (height - y - 1) + x)] = pixel <= 100 ? pixel : -1;
    }
  }
  EXPECT_EQ(file.get(), std::ifstream::traits_type::eof());
  return cells;
}

TEST(FilterMasks, Nav2KeepsOutAndSlowsDown) {
  const fs::path folder = fs::temp_directory_path() / "lamina_filter_masks";
  fs::create_directories(folder);
  NavigabilityGrid grid(0.05);
  grid.at_or_new({-1, 2}) = {0, 0, 1.0F, 1};   // level floor
  grid.at_or_new({1, 2}) = {0, 0, 0.0F, 1};    // a hole
  grid.at_or_new({-1, 3}) = {0, 0, 0.4F, 1};   // slow
  grid.at_or_new({0, 3}) = {0, 0, 0.001F, 1};  // as slow as there is
  grid.at_or_new({1, 3}).height = 0.25F;       // seen, its navigability unknown
  write_filter_masks(folder, grid);
  EXPECT_EQ(nav2_raw_mask(folder, "keepout"), (std::vector<int>{0, 0, 100, 0, 0, 0}));
  EXPECT_EQ(nav2_raw_mask(folder, "speed"), (std::vector<int>{0, 0, 0, 40, 1, 0}));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace lamina::io
