// Feeds one's own sensor: scans of a 2D lidar as they come, a pose back for each, a map at the end.
#include <cmath>
#include <cstdio>

#include <lamina/lamina.hpp>

// A lidar that drives along the middle of a room of 8 x 5 m and turns while it does.
lamina::LaserScan scan_at(double x, double yaw, double time) {
  lamina::LaserScan scan;
  scan.stamp = lamina::Timestamp::from_seconds(time);
  scan.angle_min = -M_PI;
  scan.angle_increment = 2 * M_PI / 360;
  scan.range_min = 0.1;
  scan.range_max = 20;
  for (int i = 0; i < 360; ++i) {
    const double a = yaw + scan.angle_min + i * scan.angle_increment;
    const double to_x = ((std::cos(a) > 0 ? 4 : -4) - x) / std::cos(a);
    const double to_y = (std::sin(a) > 0 ? 2.5 : -2.5) / std::sin(a);
    scan.ranges.push_back(static_cast<float>(std::min(to_x, to_y)));
  }
  return scan;
}

int main(int argc, char** argv) try {
  lamina::Calibration calibration;
  calibration.lidar.emplace();
  lamina::OnlineMapper mapper(calibration, lamina::preset_options(calibration));
  for (int i = 0; i < 60; ++i) {
    const double x = -2 + 0.05 * i, yaw = 0.01 * i;
    const auto T_map_body = mapper.add(scan_at(x, yaw, 0.1 * i));
    if (T_map_body && i % 20 == 0)
      std::printf("%.1f s: x %.3f m, y %.3f m\n", 0.1 * i, T_map_body->translation().x(),
                  T_map_body->translation().y());
  }
  std::printf("%zu walls\n", mapper.map().planes.size());
  if (argc > 1) mapper.save(argv[1]);
  return mapper.map().planes.empty() ? 1 : 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
