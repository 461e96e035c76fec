// Maps as ROS 2 messages in CDR.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <lamina/grid/occupancy_grid.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina::publish {

/// Where and when a message's content is.
struct Header {
  Timestamp stamp;
  std::string frame;
};

/// Cells of nav_msgs/OccupancyGrid: 0 free, 100 occupied, -1 unknown; row 0 at the least y.
struct GridCells {
  double resolution = 0, x = 0, y = 0;  ///< m; x, y: lower left corner, map frame
  std::uint32_t width = 0, height = 0;
  std::vector<std::int8_t> cells;  ///< width * height
};
/// By the thresholds of occupancy.yaml, so that both are one grid.
GridCells cells_of(const OccupancyGrid& grid);

/// A rectangle of cells.
struct CellRange {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};
/// The smallest in which grids of one geometry differ; of no width where they do not.
CellRange changed_cells(const GridCells& before, const GridCells& after);

/// nav_msgs/OccupancyGrid.
std::string grid_message(const GridCells& grid, const Header& header);
/// map_msgs/OccupancyGridUpdate.
std::string grid_update_message(const GridCells& grid, const CellRange& range,
                                const Header& header);
/// nav_msgs/Path.
std::string path_message(const Trajectory& path, const Header& header);
/// visualization_msgs/MarkerArray (as since Humble): planes as triangles in the colours of
/// planes.ply, a marker for each label.
std::string planes_message(const std::vector<MapPlane>& planes, const Header& header);
/// Likewise: a square for each surfel, in one marker.
std::string surfels_message(const std::vector<Surfel>& surfels, const Header& header);
/// sensor_msgs/PointCloud2 of x, y, z (float32, m): rims where the ground falls away.
std::string edges_message(const std::vector<EdgePoint>& edges, const Header& header);
/// sensor_msgs/LaserScan.
std::string scan_message(const LaserScan& scan, const std::string& frame);
/// tf2_msgs/TFMessage of one transform: `T` is the pose of `child` in the header's frame.
std::string transform_message(const SE3& T, const std::string& child, const Header& header);

}  // namespace lamina::publish
