// Reads a map's planes and path back from its folder.
#include <cmath>
#include <cstdio>

#include <lamina/io/map_files.hpp>

int main(int argc, char** argv) try {
  if (argc != 2) return std::fputs("usage: read_map FOLDER\n", stderr), 2;
  const std::filesystem::path folder = argv[1];
  const auto path = lamina::Trajectory::read_tum((folder / "trajectory.txt").string());
  std::printf("%zu poses, %.1f m\n", path.size(), path.length());
  for (const lamina::MapPlane& plane : lamina::io::read_planes_json(folder / "planes.json")) {
    const Eigen::Vector3d& n = plane.plane_map.normal();
    std::printf("plane %ld: normal (%.3f, %.3f, %.3f), rho %.3f +- %.3f m, %.1f m2\n",
                static_cast<long>(plane.id), n.x(), n.y(), n.z(), plane.plane_map.rho(),
                std::sqrt(plane.covariance(2, 2)), plane.area);
  }
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
