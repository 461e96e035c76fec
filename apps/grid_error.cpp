// Confusion of free and blocked, and heights.
#include <lamina/apps/grid_error.hpp>

#include <cmath>

namespace lamina::apps {

GridErrors grid_errors(const NavigabilityGrid& grid, const NavigabilityGrid& truth) {
  GridErrors errors;
  double sum = 0, squares = 0;
  std::int64_t heights = 0, called_free = 0;
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (!cell.known()) return;
    const NavigabilityCell* real =
        truth.find(cell_of(center_of(c, grid.resolution()), truth.resolution()));
    if (real == nullptr || !real->known()) return;
    ++errors.compared;
    const bool free = cell.navigability >= GridErrors::kFree;
    const bool truly = real->navigability >= GridErrors::kFree;
    called_free += free;
    if (truly) {
      ++errors.true_free;
    } else {
      ++errors.true_blocked;
    }
    if (free && !truly) {
      ++errors.false_free;
      if (errors.false_free_cells.size() < 1000) errors.false_free_cells.push_back(c);
    }
    if (!free && truly) ++errors.false_blocked;
    if (free && truly && std::isfinite(cell.height) && std::isfinite(real->height)) {
      const double d = static_cast<double>(cell.height) - static_cast<double>(real->height);
      sum += d;
      squares += d * d;
      errors.height_max_m = std::max(errors.height_max_m, std::abs(d));
      ++heights;
    }
  });
  const auto share = [](std::int64_t part, std::int64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
  };
  errors.false_free_share = share(errors.false_free, called_free);
  errors.false_blocked_share = share(errors.false_blocked, errors.true_free);
  if (heights > 0) {
    errors.height_bias_m = sum / static_cast<double>(heights);
    errors.height_rms_m = std::sqrt(squares / static_cast<double>(heights));
  }
  return errors;
}

}  // namespace lamina::apps
