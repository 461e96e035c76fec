// Messages of a map, read field by field as their definitions have them.
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <gtest/gtest.h>

#include <cstring>

#include <lamina/pipeline/publish/map_messages.hpp>
#include <lamina/pipeline/publish/odometry_poses.hpp>

namespace lamina::publish {
namespace {

using eprosima::fastcdr::Cdr;

const Header kHeader{Timestamp::from_nanoseconds(12500000000), "map"};

// Reads in order; done() once nothing is left.
class Fields {
 public:
  explicit Fields(std::string message)
      : bytes_(std::move(message)),
        buffer_(bytes_.data(), bytes_.size()),
        cdr_(buffer_, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR) {
    cdr_.read_encapsulation();
  }
  template <class Value>
  Value get() {
    Value value{};
    cdr_ >> value;
    return value;
  }
  void expect_header(const std::string& frame = "map", std::int32_t seconds = 12,
                     std::uint32_t nanoseconds = 500000000) {
    EXPECT_EQ(get<std::int32_t>(), seconds);
    EXPECT_EQ(get<std::uint32_t>(), nanoseconds);
    EXPECT_EQ(get<std::string>(), frame);
  }
  std::vector<double> doubles(int count) {
    std::vector<double> all;
    for (int i = 0; i < count; ++i) all.push_back(get<double>());
    return all;
  }
  bool done() const { return cdr_.getSerializedDataLength() == bytes_.size(); }

 private:
  std::string bytes_;
  eprosima::fastcdr::FastBuffer buffer_;
  Cdr cdr_;
};

GridCells cells() {
  GridCells grid;
  grid.resolution = 0.05;
  grid.x = -1;
  grid.y = 2;
  grid.width = 3;
  grid.height = 2;
  grid.cells = {0, 100, -1, 0, 0, 100};
  return grid;
}

TEST(MapMessages, Grid) {
  Fields in(grid_message(cells(), kHeader));
  in.expect_header();
  in.get<std::int32_t>(), in.get<std::uint32_t>();  // loaded when
  EXPECT_FLOAT_EQ(in.get<float>(), 0.05f);
  EXPECT_EQ(in.get<std::uint32_t>(), 3u);
  EXPECT_EQ(in.get<std::uint32_t>(), 2u);
  EXPECT_EQ(in.doubles(7), (std::vector<double>{-1, 2, 0, 0, 0, 0, 1}));
  EXPECT_EQ(in.get<std::vector<std::int8_t>>(), cells().cells);
  EXPECT_TRUE(in.done());
}

TEST(MapMessages, UpdateHoldsTheRectangleThatChanged) {
  GridCells after = cells();
  after.cells[1] = 0;
  after.cells[5] = -1;
  const CellRange range = changed_cells(cells(), after);
  EXPECT_EQ(range.x, 1u);
  EXPECT_EQ(range.width, 2u);
  EXPECT_EQ(range.height, 2u);
  EXPECT_EQ(changed_cells(after, after).width, 0u);
  Fields in(grid_update_message(after, range, kHeader));
  in.expect_header();
  EXPECT_EQ(in.get<std::int32_t>(), 1);
  EXPECT_EQ(in.get<std::int32_t>(), 0);
  EXPECT_EQ(in.get<std::uint32_t>(), 2u);
  EXPECT_EQ(in.get<std::uint32_t>(), 2u);
  EXPECT_EQ(in.get<std::vector<std::int8_t>>(), (std::vector<std::int8_t>{0, -1, 0, -1}));
  EXPECT_TRUE(in.done());
}

TEST(MapMessages, GridOfScansHasTheThresholdsOfItsFile) {
  OccupancyGrid grid;
  for (int i = 0; i < 5; ++i)
    grid.add(SE3(SO3(), {0, 0, 0.3}), {{Eigen::Vector2d(1, 0), 0.01, true, true}});
  const GridCells all = cells_of(grid);
  ASSERT_EQ(all.cells.size(), std::size_t{all.width} * all.height);
  EXPECT_GE(std::count(all.cells.begin(), all.cells.end(), 0), 15);
  EXPECT_GE(std::count(all.cells.begin(), all.cells.end(), 100), 1);
}

TEST(MapMessages, Path) {
  Trajectory path;
  path.add(Timestamp::from_nanoseconds(1500000000), SE3(SO3(), {1, 2, 3}));
  Fields in(path_message(path, kHeader));
  in.expect_header();
  EXPECT_EQ(in.get<std::uint32_t>(), 1u);
  in.expect_header("map", 1, 500000000);
  EXPECT_EQ(in.doubles(7), (std::vector<double>{1, 2, 3, 0, 0, 0, 1}));
  EXPECT_TRUE(in.done());
}

TEST(MapMessages, PlanesAreTrianglesByLabel) {
  MapPlane floor;
  floor.label = PlaneLabel::kFloor;
  floor.outlines_map = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
  Fields in(planes_message({floor}, kHeader));
  ASSERT_EQ(in.get<std::uint32_t>(), 6u);
  for (int marker = 0; marker < 6; ++marker) {
    in.expect_header();
    EXPECT_EQ(in.get<std::string>(), to_string(static_cast<PlaneLabel>(marker)));
    EXPECT_EQ(in.get<std::int32_t>(), 0);
    EXPECT_EQ(in.get<std::int32_t>(), 11);  // TRIANGLE_LIST
    EXPECT_EQ(in.get<std::int32_t>(), 0);   // ADD
    EXPECT_EQ(in.doubles(10), (std::vector<double>{0, 0, 0, 0, 0, 0, 1, 1, 1, 1}));
    for (int i = 0; i < 4; ++i) in.get<float>();
    EXPECT_EQ(in.get<std::int32_t>() + static_cast<int>(in.get<std::uint32_t>()), 0);
    EXPECT_FALSE(in.get<bool>());
    const auto corners = in.get<std::uint32_t>();
    EXPECT_EQ(corners, marker == 0 ? 6u : 0u);
    in.doubles(static_cast<int>(3 * corners));
    EXPECT_EQ(in.get<std::uint32_t>(), 0u);  // colours
    EXPECT_EQ(in.get<std::string>(), "");    // texture_resource
    in.expect_header("", 0, 0);              // texture
    EXPECT_EQ(in.get<std::string>(), "");    // its format
    EXPECT_EQ(in.get<std::uint32_t>(), 0u);  // its data
    EXPECT_EQ(in.get<std::uint32_t>(), 0u);  // uv_coordinates
    EXPECT_EQ(in.get<std::string>(), "");    // text
    EXPECT_EQ(in.get<std::string>(), "");    // mesh_resource
    EXPECT_EQ(in.get<std::string>(), "");    // mesh_file.filename
    EXPECT_EQ(in.get<std::uint32_t>(), 0u);  // mesh_file.data
    EXPECT_FALSE(in.get<bool>());            // mesh_use_embedded_materials
  }
  EXPECT_TRUE(in.done());
}

TEST(MapMessages, EdgesArePointsWhereTheGroundFallsAway) {
  Fields in(edges_message({{{1, 2, 3}, 0.01, true}, {{4, 5, 6}, 0.01, false}}, kHeader));
  in.expect_header();
  EXPECT_EQ(in.get<std::uint32_t>(), 1u);
  EXPECT_EQ(in.get<std::uint32_t>(), 1u);
  ASSERT_EQ(in.get<std::uint32_t>(), 3u);
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(in.get<std::string>(), std::string(1, static_cast<char>('x' + i)));
    EXPECT_EQ(in.get<std::uint32_t>(), 4 * i);
    EXPECT_EQ(in.get<std::uint8_t>(), 7);  // FLOAT32
    EXPECT_EQ(in.get<std::uint32_t>(), 1u);
  }
  EXPECT_FALSE(in.get<bool>());
  EXPECT_EQ(in.get<std::uint32_t>(), 12u);
  EXPECT_EQ(in.get<std::uint32_t>(), 12u);
  const auto data = in.get<std::vector<std::uint8_t>>();
  ASSERT_EQ(data.size(), 12u);
  float z = 0;
  std::memcpy(&z, data.data() + 8, sizeof z);
  EXPECT_FLOAT_EQ(z, 3);
  EXPECT_TRUE(in.get<bool>());
  EXPECT_TRUE(in.done());
}

TEST(OdometryPoses, BetweenItsNeighboursAndNearItsEnds) {
  OdometryPoses poses;
  const auto at = [](double s) { return Timestamp::from_seconds(s); };
  EXPECT_FALSE(poses.at(at(1)));
  poses.add(at(1), SE3(SO3(), {1, 0, 0}));
  poses.add(at(2), SE3(SO3(), {2, 0, 0}));
  EXPECT_NEAR(poses.at(at(1.5))->translation().x(), 1.5, 1e-12);
  EXPECT_NEAR(poses.at(at(2.5))->translation().x(), 2, 1e-12);
  EXPECT_FALSE(poses.at(at(4)));
}

}  // namespace
}  // namespace lamina::publish
