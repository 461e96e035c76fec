// Times of the rasterizer on a map of 400 x 400 m: from scratch, and one frame's changes.
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <vector>

#include <lamina/grid/rasterizer.hpp>

namespace {

using namespace lamina;

// Of this process: what others do on the machine does not count. (User time alone is told in ticks
// of the system's clock, longer than an update.)
double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double resident_mb() {
  std::ifstream in("/proc/self/statm");
  double total = 0, resident = 0;
  in >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

MapPlane plane_of(const Plane& plane, std::vector<Eigen::Vector3d> outline) {
  MapPlane p;
  p.plane_map = plane;
  p.centroid_map.setZero();
  for (const auto& v : outline) p.centroid_map += v / static_cast<double>(outline.size());
  p.covariance = Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal();
  p.outlines_map.push_back(std::move(outline));
  return p;
}

Surfel surfel(double x, double y, double z) {
  Surfel s;
  s.center = {x, y, z};
  s.radius = 0.1 / std::sqrt(3.14159265358979);
  s.covariance = Eigen::Vector3d(1e-4, 1e-4, 9e-6).asDiagonal();
  return s;
}

// A tour around 400 x 400 m: a corridor of surfels under the path, floor planes of 25 m^2 along it,
// walls beside it, furniture, loose points.
PlanarMap big_map() {
  std::mt19937 random(1);
  const auto number = [&random] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  PlanarMap map;
  constexpr int kAcross = 20;  // surfels
  const double length = 200000.0 / kAcross * 0.1;
  const auto place = [](double s, double side) {
    const int row = static_cast<int>(s / 400);
    return Eigen::Vector2d(s - 400 * row - 200, 160.0 * row - 160 + side);
  };
  for (int k = 0; k < 200000; ++k) {
    const Eigen::Vector2d p = place(0.1 * (k / kAcross) + 0.05, 0.1 * (k % kAcross) - 1 + 0.05);
    map.surfels.push_back(surfel(p.x(), p.y(), 0.003 * number()));
  }
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector2d p = place(length * (k + 0.5) / 2000, 3 * number());
    if (k % 10 == 0) {
      const double x = p.x(), y = p.y();
      map.planes.push_back(plane_of(Plane(), {{x - 2.5, y - 2.5, 0},
                                              {x + 2.5, y - 2.5, 0},
                                              {x + 2.5, y + 2.5, 0},
                                              {x - 2.5, y + 2.5, 0}}));
      continue;
    }
    const double a = 3.2 * number(), h = k % 2 ? 2.5 : 0.7;
    const Eigen::Vector3d foot(p.x(), p.y() + 2, 0), along(std::cos(a), std::sin(a), 0),
        normal(std::sin(a), -std::cos(a), 0), up(0, 0, h);
    map.planes.push_back(
        plane_of(Plane(normal, normal.dot(foot)),
                 {foot - along, foot + along, foot + along + up, foot - along + up}));
  }
  for (int k = 0; k < 5000; ++k) {
    const Eigen::Vector2d p = place(length * (k + 0.5) / 5000, 2 * number());
    map.loose_points.emplace_back(p.x(), p.y(), 0.4 + 0.3 * number());
  }
  for (int k = 0; k < 10000; ++k) {
    const Eigen::Vector2d p = place(0.1 * k, 0);
    map.trajectory.add(Timestamp::from_nanoseconds(k * 100'000'000LL),
                       SE3(SO3(), {p.x(), p.y(), 0}));
  }
  return map;
}

void print(const char* what, std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  std::printf("%-44s median %8.2f   least %8.2f   most %8.2f\n", what, ms[ms.size() / 2],
              ms.front(), ms.back());
}

}  // namespace

int main() {
  PlanarMap map = big_map();
  const double before = resident_mb();
  std::vector<double> full;
  Rasterizer rasterizer;
  for (int k = 0; k < 5; ++k) {
    rasterizer = Rasterizer();
    const double start = cpu_ms();
    rasterizer.update(map);
    full.push_back(cpu_ms() - start);
  }
  std::int64_t known = 0;
  rasterizer.grid().for_each(
      [&](const CellIndex&, const NavigabilityCell& c) { known += c.known(); });
  std::printf("%zu planes, %zu surfels, %lld cells known, %zu tiles, %.0f MB\n", map.planes.size(),
              map.surfels.size(), static_cast<long long>(known), rasterizer.tiles_drawn(),
              resident_mb() - before);
  std::printf("CPU time, ms\n");
  print("full raster", full);

  // One frame: the surfels of 4 x 2 m move by a millimetre; one wall changes.
  const auto change = [&map](std::size_t first, double dz) {
    RasterChanges changes;
    for (std::size_t s = first; s < first + 800; ++s) {
      map.surfels[s].center.z() += dz;
      changes.surfels.push_back(s);
    }
    const std::size_t wall = 1 + 10 * (first / 1000);
    for (auto& v : map.planes[wall].outlines_map[0]) v.z() += dz;
    changes.planes.push_back(wall);
    return changes;
  };
  // Anywhere, where nothing of it is in the processor's memory; and as a robot drives, 0.1 m a
  // frame.
  std::vector<double> observed, driven, found;
  double tiles = 0;
  std::mt19937 random(2);
  for (int k = 0; k < 200; ++k) {
    const RasterChanges changes = change(20 * (random() % 9900), 0.001);
    const double start = cpu_ms();
    rasterizer.update(map, changes);
    observed.push_back(cpu_ms() - start);
    tiles += static_cast<double>(rasterizer.tiles_drawn()) / 200;
  }
  // As above, and a surfel rises out of the floor or sinks back: what is connected changes, too.
  std::vector<double> joined;
  for (int k = 0; k < 200; ++k) {
    RasterChanges changes;
    const std::size_t first = 20 * (random() % 9900);
    for (std::size_t s = first; s < first + 800; ++s) {
      map.surfels[s].center.z() -= 0.001;
      changes.surfels.push_back(s);
    }
    double& z = map.surfels[first].center.z();
    z += z < 0.05 ? 0.1 : -0.1;
    const double start = cpu_ms();
    rasterizer.update(map, changes);
    joined.push_back(cpu_ms() - start);
  }
  for (int k = 0; k < 20; ++k) {
    map.surfels[static_cast<std::size_t>(k) * 999].center.z() += 0.001;
    const double start = cpu_ms();
    rasterizer.update(map);
    found.push_back(cpu_ms() - start);
  }
  std::printf("one frame: 800 surfels and a wall, %.1f tiles\n", tiles);
  print("update, told what changed", observed);
  print("update that changes what is connected", joined);
  print("update, comparing the whole map", found);
  return 0;
}
