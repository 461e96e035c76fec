// Rays drawn into cells.
#include <lamina/backend/merging/free_space.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/models/checked_cast.hpp>

namespace lamina {

std::int64_t FreeSpace::index(double x) { return to_far_cell(x / kCell); }

void FreeSpace::add_ray(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map) {
  const Eigen::Vector2d from = from_map.head<2>(), way = to_map.head<2>() - from;
  const double length = way.norm();
  if (!std::isfinite(length) || length > 1e3 || from.norm() > 1e7) return;
  const auto more = [](std::uint16_t& count) {
    if (count < std::numeric_limits<std::uint16_t>::max()) ++count;
  };
  std::int64_t last = std::numeric_limits<std::int64_t>::min();
  for (double along = 0; along < length - kCell; along += kCell / 2) {
    const Eigen::Vector2d p = from + way * (along / length);
    const std::int64_t at = key(index(p.x()), index(p.y()));
    if (at != last) more(cells_[at].crossed);
    last = at;
  }
  more(cells_[key(index(to_map.x()), index(to_map.y()))].hit);
  rays_ += 1;
  sum_z_ += (from_map.z() + to_map.z()) / 2;
}

bool FreeSpace::free(const Eigen::Vector2d& point_map) const {
  const std::int64_t i = index(point_map.x()), j = index(point_map.y());
  const auto here = cells_.find(key(i, j));
  if (here == cells_.end() || here->second.crossed < 3) return false;
  for (std::int64_t di = -1; di <= 1; ++di) {
    for (std::int64_t dj = -1; dj <= 1; ++dj) {
      const auto near = cells_.find(key(i + di, j + dj));
      // A stray return in what many rays crossed is a person or an edge.
      if (near != cells_.end() && 20 * near->second.hit > near->second.crossed) return false;
    }
  }
  return true;
}

}  // namespace lamina
