// Confusion of free and blocked, and heights.
#include <lamina/pipeline/evaluation/grid_error.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

// What is true around each cell: how far to the next edge, and from free ground.
class TrueGround {
 public:
  TrueGround(const NavigabilityGrid& truth, double tolerance)
      : truth_(truth),
        reach_(static_cast<int>(std::floor(tolerance / truth.resolution() + 1e-9))) {}

  const NavigabilityCell* at(const CellIndex& c) const {
    const NavigabilityCell* cell = truth_.find(c);
    return cell != nullptr && cell->known() ? cell : nullptr;
  }
  bool free(const CellIndex& c) const {
    const NavigabilityCell* cell = at(c);
    return cell != nullptr && cell->navigability >= GridErrors::kFree;
  }
  /// Free and level with all neighbours for the tolerance around.
  bool flat(const CellIndex& c) const {
    const NavigabilityCell* middle = at(c);
    if (middle == nullptr || !free(c)) return false;
    bool flat = true;
    around(c, reach_, [&](const CellIndex& other) {
      const NavigabilityCell* cell = at(other);
      flat = flat && cell != nullptr && free(other) &&
             std::abs(cell->height - middle->height) <= GridErrors::kFlatStep;
    });
    return flat;
  }
  bool free_beside(const CellIndex& c) const {
    bool any = false;
    around(c, 1, [&](const CellIndex& other) { any = any || free(other); });
    return any;
  }
  /// Below the nearest free ground (within 30 cells), or nothing there at all.
  bool pit(const CellIndex& c) const {
    const NavigabilityCell* cell = at(c);
    if (cell == nullptr || std::isnan(cell->height)) return true;
    for (int reach = 1; reach <= 30; ++reach) {
      float floor = NavigabilityCell::kUnknown;
      around(c, reach, [&](const CellIndex& other) {
        if (free(other)) floor = at(other)->height;
      });
      if (floor == floor) return cell->height < floor - GridErrors::kPit;
    }
    return false;
  }

 private:
  template <class Visit>
  static void around(const CellIndex& c, int reach, const Visit& visit) {
    for (int dj = -reach; dj <= reach; ++dj) {
      for (int di = -reach; di <= reach; ++di) visit(CellIndex{c.i + di, c.j + dj});
    }
  }
  const NavigabilityGrid& truth_;
  int reach_;
};

// Which places lie near a path: its poses every so far.
class NearPath {
 public:
  explicit NearPath(const Trajectory& path) {
    for (const StampedPose& p : path) {
      const Eigen::Vector2d xy = p.pose.translation().head<2>();
      if (places_.empty() || (xy - places_.back()).norm() > kEvery) places_.push_back(xy);
    }
  }
  bool operator()(const Eigen::Vector2d& place) const {
    constexpr double kReach2 = GridErrors::kNearPath * GridErrors::kNearPath;
    return std::any_of(places_.begin(), places_.end(), [&](const Eigen::Vector2d& p) {
      return (p - place).squaredNorm() <= kReach2;
    });
  }

 private:
  static constexpr double kEvery = 0.1;  // m
  std::vector<Eigen::Vector2d> places_;
};

// Sum of squares of what is added.
struct HeightSums {
  double sum = 0, squares = 0;
  std::int64_t count = 0;
  void add(double d) {
    sum += d;
    squares += d * d;
    ++count;
  }
  double rms() const { return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0.0; }
  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0.0; }
};

void keep(const CellIndex& c, std::vector<CellIndex>& cells) {
  if (cells.size() < 1000) cells.push_back(c);
}

// Knowledge ends there.
bool beside_unseen(const NavigabilityGrid& grid, const CellIndex& c) {
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      const NavigabilityCell* cell = grid.find({c.i + di, c.j + dj});
      if (cell == nullptr || (std::isnan(cell->height) && !cell->known())) return true;
    }
  }
  return false;
}

double share(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

}  // namespace

GridErrors grid_errors(const NavigabilityGrid& grid, const NavigabilityGrid& truth,
                       const SE3& T_truth_map, const Trajectory& path_map) {
  GridErrors errors;
  const TrueGround ground(truth, GridErrors::kTolerance);
  const NearPath near_path(path_map);
  HeightSums all, near;
  grid.for_each([&](const CellIndex& cell_index, const NavigabilityCell& cell) {
    const bool seen = cell.height == cell.height;
    const Eigen::Vector2d middle = center_of(cell_index, grid.resolution());
    const Eigen::Vector3d place =
        T_truth_map *
        Eigen::Vector3d(middle.x(), middle.y(), seen ? static_cast<double>(cell.height) : 0.0);
    const CellIndex c = cell_of(place.head<2>(), truth.resolution());
    const NavigabilityCell* real = ground.at(c);
    if (real == nullptr) return;
    const bool flat = (cell.known() || seen) && ground.flat(c);
    errors.flat_floor += flat;
    if (flat && !cell.known()) {
      ++errors.unknown_flat;
      errors.unknown_ends += beside_unseen(grid, cell_index);
    }
    if (!cell.known()) return;
    ++errors.compared;
    const bool free = cell.navigability >= GridErrors::kFree, truly = ground.free(c);
    errors.called_free += free;
    ++(truly ? errors.true_free : errors.true_blocked);
    if (free && !truly) {
      ++errors.false_free;
      errors.false_free_pits += ground.pit(c);
      errors.false_free_deep += !ground.free_beside(c);
      keep(cell_index, errors.false_free_cells);
    }
    if (!free && truly) {
      ++(flat ? errors.false_blocked : errors.blocked_edges);
      if (flat) keep(cell_index, errors.false_blocked_cells);
    }
    if (free && truly && seen && std::isfinite(real->height)) {
      const double d = place.z() - static_cast<double>(real->height);
      all.add(d);
      if (near_path(middle)) near.add(d);
      errors.height_max_m = std::max(errors.height_max_m, std::abs(d));
    }
  });
  errors.false_free_share = share(errors.false_free, errors.called_free);
  errors.false_blocked_share = share(errors.false_blocked, errors.flat_floor);
  errors.unknown_share = share(errors.unknown_flat, errors.flat_floor);
  errors.height_bias_m = all.mean();
  errors.height_rms_m = all.rms();
  errors.near_height_rms_m = near.rms();
  errors.near_heights = near.count;
  return errors;
}

PathErrors path_errors(const std::vector<Eigen::Vector2d>& path_map, const NavigabilityGrid& truth,
                       const SE3& T_truth_map) {
  PathErrors errors;
  const TrueGround ground(truth, GridErrors::kTolerance);
  const auto look = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector3d place = T_truth_map * Eigen::Vector3d(p.x(), p.y(), 0);
    ++errors.places;
    errors.not_free += !ground.free(cell_of(place.head<2>(), truth.resolution()));
  };
  for (std::size_t k = 0; k < path_map.size(); ++k) {
    look(path_map[k]);
    if (k > 0) look(0.5 * (path_map[k - 1] + path_map[k]));
  }
  return errors;
}

}  // namespace lamina
