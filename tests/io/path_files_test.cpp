// Paths and terrain go to files others can read.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <lamina/io/path_files.hpp>
#include <lamina/io/ply_files.hpp>
#include <lamina/io/terrain_files.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

class PathFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() / (std::string("lamina_path_") +
                                     testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string content(const std::string& name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }
  fs::path folder_;
};

NavigabilityGrid two_by_two() {
  NavigabilityGrid grid(0.5);
  grid.at_or_new({0, 0}) = {0.0F, 0, 1.0F, 1};
  grid.at_or_new({1, 0}) = {0.25F, 0, 0.0F, 1};
  grid.at_or_new({0, 1}) = {0.5F, 0, NavigabilityCell::kUnknown, NavigabilityCell::kUnknown};
  grid.at_or_new({1, 1}) = {1.0F, 0, 0.5F, 1};
  return grid;
}

TEST_F(PathFiles, CsvHasALineAPoint) {
  write_path_csv(folder_ / "path.csv", {{0.025, -1}, {1.5, 2.00004}});
  EXPECT_EQ(content("path.csv"), "x,y\n0.0250,-1.0000\n1.5000,2.0000\n");
  const auto back = read_path_csv(folder_ / "path.csv");
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0], Eigen::Vector2d(0.025, -1));
  std::ofstream(folder_ / "path.csv") << "x,y\n1,2\n3;4\n";
  EXPECT_THROW(read_path_csv(folder_ / "path.csv"), Error);
}

TEST_F(PathFiles, PictureIsAPngOfTheScaledGrid) {
  write_path_png(folder_ / "path.png", two_by_two(), {{0.25, 0.25}, {0.75, 0.75}});
  const std::string png = content("path.png");
  ASSERT_GT(png.size(), 30u);
  EXPECT_EQ(png.substr(1, 3), "PNG");
  EXPECT_EQ(png.substr(16, 8), std::string("\0\0\0\x20\0\0\0\x20", 8)) << "32 x 32 pixels";
  write_path_png(folder_ / "empty.png", NavigabilityGrid(0.1), {});
  EXPECT_TRUE(fs::exists(folder_ / "empty.png"));
}

TEST_F(PathFiles, TerrainIsAMeshOfTheHeights) {
  write_terrain_ply(folder_ / "terrain.ply", two_by_two());
  const std::string ply = content("terrain.ply");
  EXPECT_NE(ply.find("element vertex 4\n"), std::string::npos);
  EXPECT_NE(ply.find("element face 2\n"), std::string::npos);
  const std::size_t body = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size(), body + 4 * 15 + 2 * 13);
  float xyz[3];
  std::memcpy(xyz, ply.data() + body + 15, sizeof xyz);
  EXPECT_EQ(xyz[0], 0.75F);
  EXPECT_EQ(xyz[1], 0.25F);
  EXPECT_EQ(xyz[2], 0.25F);
  EXPECT_EQ(ply.substr(body + 12, 3), std::string("\0\xff\0", 3)) << "free is green";
  EXPECT_EQ(ply.substr(body + 15 + 12, 3), std::string("\xff\0\0", 3)) << "blocked is red";
}

// UTM coordinates: floats are half a metre apart there.
TEST_F(PathFiles, PlacesFarFromTheOriginKeepTheirMillimetres) {
  const Eigen::Vector3d place(400000.123, 5000000.456, 0.1);
  const auto first_in = [this](const char* name) {
    const std::string ply = content(name);
    EXPECT_NE(ply.find("property double x\nproperty double y\nproperty double z\n"),
              std::string::npos);
    Eigen::Vector3d first;
    std::memcpy(first.data(), ply.data() + ply.find("end_header\n") + 11, sizeof first);
    return first;
  };
  Surfel surfel;
  surfel.center = place;
  write_surfels_ply(folder_ / "surfels.ply", {surfel});
  EXPECT_EQ(first_in("surfels.ply"), place);
  MapPlane plane;
  plane.outlines_map = {{place, place, place}};
  write_planes_ply(folder_ / "planes.ply", {plane});
  EXPECT_EQ(first_in("planes.ply"), place);
  NavigabilityGrid grid(0.5);
  grid.at_or_new({800000, 10000000}).height = 0.25F;
  write_terrain_ply(folder_ / "terrain.ply", grid);
  EXPECT_EQ(first_in("terrain.ply"), Eigen::Vector3d(400000.25, 5000000.25, 0.25));
}

}  // namespace
}  // namespace lamina::io
