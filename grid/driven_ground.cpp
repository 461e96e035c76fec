// Circles along the path, and what is open in them.
#include <lamina/grid/driven_ground.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace lamina {
namespace {

constexpr double kStride = 1;  // m: longer steps of a path do not tell its way

template <class Visit>
void for_each_within(const Eigen::Vector3d& p, double radius, double resolution,
                     const Visit& visit) {
  const Eigen::Vector2d reach(radius, radius);
  const CellIndex low = cell_of(p.head<2>() - reach, resolution),
                  high = cell_of(p.head<2>() + reach, resolution);
  for (auto j = low.j; j <= high.j; ++j) {
    for (auto i = low.i; i <= high.i; ++i) {
      const double off = (center_of({i, j}, resolution) - p.head<2>()).norm();
      if (off <= radius) visit(CellIndex{i, j}, off);
    }
  }
}

class Driven {
 public:
  Driven(const Rasterizer& rasterizer, const DrivenOptions& options)
      : rasterizer_(rasterizer), grid_(rasterizer.grid()), options_(options) {}

  void over(const Eigen::Vector3d& p) {
    const double resolution = grid_.resolution();
    bool on_floor = false;
    for_each_within(p, options_.radius, resolution, [&](const CellIndex& c, double) {
      const NavigabilityCell* cell = grid_.find(c);
      on_floor = on_floor || (cell != nullptr && std::isfinite(cell->height) && level(*cell, p));
    });
    if (!on_floor) return;  // carried, or nothing was seen of it
    for_each_within(p, options_.radius, resolution, [&](const CellIndex& c, double off) {
      const NavigabilityCell* cell = grid_.find(c);
      if (cell != nullptr && (cell->known() || !level(*cell, p))) return;
      if (off <= options_.under || by_noise(c)) cells_.push_back({c, static_cast<float>(p.z())});
    });
  }
  std::vector<DrivenCell> take() {
    const auto before = [](const DrivenCell& a, const DrivenCell& b) { return a.cell < b.cell; };
    std::stable_sort(cells_.begin(), cells_.end(), before);
    const auto same = [](const DrivenCell& a, const DrivenCell& b) { return a.cell == b.cell; };
    cells_.erase(std::unique(cells_.begin(), cells_.end(), same), cells_.end());
    return std::move(cells_);
  }

 private:
  bool level(const NavigabilityCell& cell, const Eigen::Vector3d& p) const {
    return !std::isfinite(cell.height) ||
           std::abs(static_cast<double>(cell.height) - p.z()) <= options_.floor;
  }
  bool by_noise(const CellIndex& c) const {
    const UnknownCause unknown_cause = rasterizer_.unknown_cause(c);
    return unknown_cause == UnknownCause::kStep || unknown_cause == UnknownCause::kSlope;
  }
  const Rasterizer& rasterizer_;
  const NavigabilityGrid& grid_;
  const DrivenOptions& options_;
  std::vector<DrivenCell> cells_;
};

}  // namespace

std::vector<DrivenCell> driven_over(const Rasterizer& rasterizer, const Trajectory& path,
                                    const DrivenOptions& options) {
  Driven driven(rasterizer, options);
  const double spacing = 0.5 * rasterizer.grid().resolution();
  std::optional<Eigen::Vector3d> last;
  for (const StampedPose& pose : path) {
    const Eigen::Vector3d p = pose.pose.translation();
    if (!p.allFinite()) continue;
    const double step = last ? (p - *last).norm() : 0;
    if (last && step < spacing) continue;
    const int n = last && step < kStride ? static_cast<int>(std::ceil(step / spacing)) : 1;
    for (int k = 1; k <= n; ++k)
      driven.over(n == 1 ? p : Eigen::Vector3d(*last + static_cast<double>(k) / n * (p - *last)));
    last = p;
  }
  return driven.take();
}

void free_cells(NavigabilityGrid& grid, const std::vector<DrivenCell>& cells, double confidence) {
  for (const DrivenCell& driven : cells) {
    NavigabilityCell& cell = grid.at_or_new(driven.cell);
    if (!std::isfinite(cell.height)) cell.height = driven.height;
    if (!std::isfinite(cell.slope)) cell.slope = 0;
    cell.navigability = 1;
    cell.confidence = static_cast<float>(confidence);
  }
}

}  // namespace lamina
