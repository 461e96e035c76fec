// A small map folder as the program would write it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <string>

#include <lamina/io/grid_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/path_files.hpp>
#include <lamina/io/ply_files.hpp>

namespace lamina::viewer {

inline constexpr int kSamplePlanes = 3;

inline MapPlane sample_plane(std::int64_t id, PlaneLabel label, const Eigen::Vector3d& corner,
                             const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  MapPlane plane;
  plane.id = id;
  plane.label = label;
  const Eigen::Vector3d n = a.cross(b).normalized();
  plane.plane_map = Plane(n, n.dot(corner));
  plane.covariance = Eigen::Vector3d(1e-6, 1e-6, 4e-6).asDiagonal();
  plane.outlines_map = {{corner, corner + a, corner + a + b, corner + b}};
  plane.area = a.cross(b).norm();
  plane.observations = 12 + id;
  plane.centroid_map = corner + 0.5 * (a + b);
  return plane;
}

/// A floor, a wall, a ramp; a grid of 4 x 3 m at 0.1 m; two trajectories, surfels, a path.
inline void write_sample_map(const std::filesystem::path& folder) {
  using V = Eigen::Vector3d;
  std::filesystem::create_directories(folder);
  io::write_planes_json(folder / "planes.json",
                        {sample_plane(0, PlaneLabel::kFloor, V(0, 0, 0), V(4, 0, 0), V(0, 3, 0)),
                         sample_plane(1, PlaneLabel::kWall, V(0, 3, 0), V(4, 0, 0), V(0, 0, 2)),
                         sample_plane(7, PlaneLabel::kRamp, V(4, 0, 0), V(2, 0, 0.3), V(0, 3, 0))});
  Trajectory after, before;
  for (int i = 0; i <= 100; ++i) {
    const double x = 0.04 * i;
    const auto stamp = Timestamp::from_seconds(1.3e9 + 0.1 * i);
    after.add(stamp, SE3(SO3(), V(x, 1.5, 0)));
    before.add(stamp, SE3(SO3(), V(x, 1.5 + 0.001 * i, 0)));
  }
  io::write_trajectory(folder / "trajectory.txt", after);
  io::write_trajectory(folder / "trajectory_before.txt", before);
  NavigabilityGrid grid(0.1);
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 30; ++j) {
      if (i != j) grid.at_or_new({i, j}) = {0.01F * static_cast<float>(i), 0.1F, 0.8F, 0.9F};
    }
  }
  io::write_grid(folder / "grid", grid);
  const io::WrittenGrid written = io::read_grid(folder / "grid");
  io::write_occupancy_map(folder, written.geometry, [&](int row, float* values) {
    layer_row(written.grid, written.geometry, row, &NavigabilityCell::confidence, values);
  });
  io::write_path_csv(folder / "path.csv", {{0.5, 0.5}, {2, 1}, {3.5, 2.5}});
  std::ofstream(folder / "graph.g2o") << "VERTEX_SE3:QUAT 0 0 1.5 0 0 0 0 1\nFIX 0\n"
                                         "VERTEX_SE3:QUAT 1 2 1.5 0 0 0 0 1\n";
  std::ofstream(folder / "scans.csv") << "1300000000,-1,1,0.1,10,1,2,1\n"
                                         "1300000005,-1,1,0.1,10,1,2,1\n";
  std::ofstream(folder / "edges.csv") << "x,y,z,sigma\n3,1,0,0.02\n3,1.1,0,0.02\n3,1.2,0,0.02\n";
  std::ofstream(folder / "window.csv") << "timestamp,keyframes,residuals,solve_ms\n"
                                          "1300000000,1,6,0.5\n1300000005,2,40,1.5\n";
  std::ofstream(folder / "metrics.json") << R"({"stages": {"floor": {"calls": 100, "median_ms": 2.5,
    "p95_ms": 4, "p99_ms": 5, "max_ms": 6}}, "skipped": {"</script><b>": 3}, "counts": {},
    "refine": {"solve_s": 0.5, "iterations": 7, "status": "converged", "moved_rms_m": 0.05,
    "cost_before": {"odometry": 9}, "cost_after": {"odometry": 3}}})";
  std::ofstream(folder / "evaluation.json")
      << R"({"trajectory": {"times": [1.3e9, 1300000001], "errors_m": [0, 0.125]}})";
}

}  // namespace lamina::viewer
