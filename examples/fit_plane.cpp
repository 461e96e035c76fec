// Fits a plane to points, says how sure it is, and moves it to another frame.
#include <cmath>
#include <cstdio>
#include <lamina/models/moments.hpp>

int main() {
  // Points of a floor 1 m under a sensor, known to 5 mm: weights are 1/sigma^2.
  const double sigma = 0.005;
  lamina::Moments moments_sensor;
  for (int i = -5; i <= 5; ++i) {
    for (int j = -5; j <= 5; ++j) {
      const double noise = sigma * ((i * 7 + j * 3) % 5 - 2) / 1.4;
      moments_sensor.add({0.1 * i, 0.1 * j, -1 + noise}, 1 / (sigma * sigma));
    }
  }
  const auto fit = moments_sensor.fit_plane(/*seen_from=*/{0, 0, 0}, /*sigma=*/1.0);
  if (!fit) return 1;
  const lamina::SE3 T_map_sensor = lamina::SE3::from_translation({0, 0, 1});
  const lamina::Plane floor_map = T_map_sensor * fit->plane;
  std::printf("floor: normal (%.4f, %.4f, %.4f), rho %.4f m +- %.4f m\n", floor_map.normal().x(),
              floor_map.normal().y(), floor_map.normal().z(), floor_map.rho(),
              std::sqrt(fit->covariance(2, 2)));
  return floor_map.normal().z() > 0.99 ? 0 : 1;
}
