// Sums over frames.
#include <lamina/frontend/depth/floor_memory.hpp>

#include <cmath>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {
constexpr double kViewStep = 0.25;  // m of movement that makes a view another view
}  // namespace

FloorMemory::Key FloorMemory::key_of(const Eigen::Vector2d& xy, double cell) const {
  return {to_cell(xy.x() / cell), to_cell(xy.y() / cell)};
}

void FloorMemory::add(const FloorResult& result, const SE3& T_odom_body) {
  T_odom_body_ = T_odom_body;
  if (result.dominant < 0) return;
  add_heights(result.surface);
  for (const Surfel& body : result.surfels_body) {
    const Surfel s = body.transformed(T_odom_body);
    discs_[key_of(s.center.head<2>(), options_.surfel_m)].fuse(s);
  }
}

void FloorMemory::add_heights(const FloorSurface& surface) {
  const Eigen::Vector2d here = T_odom_body_.translation().head<2>();
  for (int i = 0; i < surface.nx(); ++i) {
    for (int j = 0; j < surface.ny(); ++j) {
      const GroundCell& seen = surface.at(i, j);
      if (!(seen.information > 0) || !std::isfinite(seen.residual)) continue;
      const Eigen::Vector2d c = surface.center(i, j);
      const Eigen::Vector3d p = T_odom_body_ * Eigen::Vector3d(c.x(), c.y(), 0);
      Cell& cell = cells_[key_of(p.head<2>(), options_.cell_m)];
      cell.information += static_cast<double>(seen.information);
      cell.weighted_height += static_cast<double>(seen.information * seen.residual);
      cell.least_shared = std::min(cell.least_shared, static_cast<double>(seen.shared_variance));
      cell.range = c.norm();
      if (cell.views == 0 || (cell.last_view - here).norm() > kViewStep) {
        ++cell.views;
        cell.last_view = here;
      }
    }
  }
}

void FloorMemory::Disc::fuse(const Surfel& s) {
  const double of_new = 1 / std::max(1e-12, s.covariance(2, 2));
  // Another level at the same place is not the same surface: the surer one stays.
  const double step = s.normal.dot(s.center - surfel.center);
  const bool same = information > 0 && step * step < 16 * (1 / of_new + 1 / information) + 1e-6;
  if (!same) {
    if (of_new > information) *this = {s, of_new};
    return;
  }
  const double share = of_new / (of_new + information);
  if (of_new > information) {
    const double offset = -step;
    surfel = s;
    surfel.center += (1 - share) * offset * s.normal;
  } else {
    surfel.center += share * step * surfel.normal;
  }
  information += of_new;
}

std::vector<LowObstacle> FloorMemory::low_obstacles() const {
  const double reach = std::max(options_.roi_m[0], 0.5 * options_.roi_m[1]) + options_.cell_m;
  const Key low =
      key_of(T_odom_body_.translation().head<2>() - Eigen::Vector2d(reach, reach), options_.cell_m);
  EvidenceGrid grid;
  grid.cell_m = options_.cell_m;
  grid.nx = grid.ny = static_cast<int>(std::ceil(2 * reach / options_.cell_m));
  grid.origin = options_.cell_m * Eigen::Vector2d(low.first, low.second);
  grid.cells.resize(static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny));
  for (const auto& [key, cell] : cells_) {
    const int i = key.first - low.first, j = key.second - low.second;
    if (i < 0 || j < 0 || i >= grid.nx || j >= grid.ny) continue;
    CellEvidence& e = grid.cells[grid.index(i, j)];
    e.height = static_cast<float>(cell.weighted_height / cell.information);
    e.information = static_cast<float>(cell.information);
    e.shared_variance = static_cast<float>(cell.least_shared / cell.views);
    e.range = static_cast<float>(cell.range);
  }
  auto found = find_low_obstacles(grid, options_);
  const SE3 T_body_odom = T_odom_body_.inverse();
  for (LowObstacle& o : found) {
    const Eigen::Vector3d p =
        T_body_odom * Eigen::Vector3d(o.center_body.x(), o.center_body.y(), 0);
    o.center_body = p.head<2>();
  }
  return found;
}

std::vector<Surfel> FloorMemory::surfels_odom() const {
  std::vector<Surfel> result;
  result.reserve(discs_.size());
  for (const auto& [key, disc] : discs_) {
    Surfel s = disc.surfel;
    // Heights of many views are surer than one's; tilts stay the best view's.
    s.covariance(2, 2) = std::min(s.covariance(2, 2), 1 / disc.information);
    result.push_back(s);
  }
  return result;
}

void FloorMemory::forget_beyond(double radius) {
  const Eigen::Vector2d here = T_odom_body_.translation().head<2>();
  const auto far = [&](const Key& key, double side) {
    return ((Eigen::Vector2d(key.first + 0.5, key.second + 0.5) * side) - here).norm() > radius;
  };
  std::erase_if(cells_, [&](const auto& entry) { return far(entry.first, options_.cell_m); });
  std::erase_if(discs_, [&](const auto& entry) { return far(entry.first, options_.surfel_m); });
}

}  // namespace lamina
