// Likelihood grid, its sliding-maximum pyramid, and branch-and-bound over shifts and turns.
#include <lamina/frontend/motion/likelihood_grid.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/checked_cast.hpp>

namespace lamina {

LikelihoodGrid::LikelihoodGrid(const std::vector<Eigen::Vector2d>& points, double resolution,
                               double smoothing, int levels)
    : resolution_(resolution), origin_(Eigen::Vector2d::Zero()) {
  stamp(points, smoothing);
  while (static_cast<int>(levels_.size()) < levels) add_level();
}

std::size_t LikelihoodGrid::bytes() const {
  std::size_t sum = 0;
  for (const Level& l : levels_) sum += l.cells.size();
  return sum;
}

void LikelihoodGrid::stamp(const std::vector<Eigen::Vector2d>& points, double smoothing) {
  Level base;
  if (!points.empty()) {
    Eigen::Vector2d low = points.front(), high = low;
    for (const Eigen::Vector2d& p : points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const int border = to_whole(std::ceil(3 * smoothing / resolution_), 0, 100) + 1;
    // At most 2^24 cells: beyond, what is far away is left out.
    const double limit = 4000 * resolution_;
    high = high.cwiseMin(low + Eigen::Vector2d(limit, limit));
    origin_ = low - Eigen::Vector2d::Constant(border * resolution_);
    base.width = cell_x(high.x()) + border + 1;
    base.height = cell_y(high.y()) + border + 1;
    base.cells.assign(static_cast<std::size_t>(base.width) * static_cast<std::size_t>(base.height),
                      0);
    for (const Eigen::Vector2d& p : points) {
      const int px = cell_x(p.x()), py = cell_y(p.y());
      for (int y = py - border + 1; y < py + border; ++y) {
        for (int x = px - border + 1; x < px + border; ++x) {
          if (x < 0 || y < 0 || x >= base.width || y >= base.height) continue;
          const double dx = origin_.x() + (x + 0.5) * resolution_ - p.x();
          const double dy = origin_.y() + (y + 0.5) * resolution_ - p.y();
          const double value = 255 * std::exp(-0.5 * (dx * dx + dy * dy) / (smoothing * smoothing));
          std::uint8_t& cell =
              base.cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(base.width) +
                         static_cast<std::size_t>(x)];
          cell = std::max(cell, static_cast<std::uint8_t>(value + 0.5));
        }
      }
    }
  }
  levels_.push_back(std::move(base));
}

void LikelihoodGrid::add_level() {
  // Level h+1 from four entries of level h: a square of 2^(h+1) is four squares of 2^h.
  const Level& fine = levels_.back();
  const int step = 1 << (levels() - 1);
  Level coarse;
  if (fine.width > 0) {
    coarse.width = fine.width + step;
    coarse.height = fine.height + step;
    coarse.cells.assign(
        static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height), 0);
    // Stored shifted by the reach, so the entry of the window that starts at x stands at x + reach.
    for (int y = 0; y < fine.height; ++y) {
      for (int x = 0; x < fine.width; ++x) {
        const std::uint8_t value =
            fine.cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine.width) +
                       static_cast<std::size_t>(x)];
        if (value == 0) continue;
        for (const int yy : {y, y + step}) {
          for (const int xx : {x, x + step}) {
            std::uint8_t& cell =
                coarse.cells[static_cast<std::size_t>(yy) * static_cast<std::size_t>(coarse.width) +
                             static_cast<std::size_t>(xx)];
            cell = std::max(cell, value);
          }
        }
      }
    }
  }
  levels_.push_back(std::move(coarse));
}

namespace {

struct Cell {
  int x, y;
};
struct Candidate {
  int turn, dx, dy;  ///< index of the turn; shift in cells
  std::int64_t sum;  ///< bound (or value) of the summed likelihood
};

constexpr int kMostSteps = 10000;  // either way: 500 m of cells, half a turn of a point 160 m off

class Search {
 public:
  Search(const std::vector<SearchLayer>& layers, const PlanarPose& start,
         const SearchWindow& window)
      : layers_(layers), start_(start), window_(window) {
    double farthest = 1;
    for (const SearchLayer& layer : layers) {
      resolution_ = layer.grid->resolution();
      levels_ = layer.grid->levels();
      full_ += 255.0 * layer.weight * static_cast<double>(layer.points_scan.size());
      for (const Eigen::Vector2d& p : layer.points_scan) farthest = std::max(farthest, p.norm());
    }
    step_ = resolution_ / farthest;
    turns_ = to_whole(std::ceil(std::min(window.rotation, M_PI) / step_), 0, kMostSteps);
    shifts_ = to_whole(std::ceil(window.translation / resolution_), 0, kMostSteps);
    cells_.resize(static_cast<std::size_t>(2 * turns_ + 1));
  }

  std::optional<CorrelativeMatch> run(double min_score) {
    // A start beyond 1e7 m is no place.
    if (!(full_ > 0) || !(start_.translation().norm() < 1e7)) return std::nullopt;
    best_ = Candidate{0, 0, 0, static_cast<std::int64_t>(std::floor(min_score * full_))};
    int level = 0;
    while (level + 1 < levels_ && (1 << (level + 1)) <= 2 * shifts_) ++level;
    hold_to_budget(level);
    std::vector<Candidate> roots;
    for (int turn = -turns_; turn <= turns_; ++turn) {
      for (int dx = -shifts_; dx <= shifts_; dx += 1 << level) {
        for (int dy = -shifts_; dy <= shifts_; dy += 1 << level) {
          const Candidate c{turn, dx, dy, sum(level, turn, dx, dy)};
          if (c.sum > best_.sum) roots.push_back(c);
        }
      }
    }
    descend(roots, level);
    if (!found_) return std::nullopt;
    return CorrelativeMatch{pose(best_), static_cast<double>(best_.sum) / full_};
  }

 private:
  /// What a search may cost: some 15 ms for the first look everywhere, twice that for the rest.
  static constexpr double kMostSums = 1.5e7;

  /// Windows as wide as wheels that leapt by 60 m suggest are searched as far as that allows.
  void hold_to_budget(int level) {
    double points = 0;
    for (const SearchLayer& layer : layers_)
      points += static_cast<double>(layer.points_scan.size());
    const double side = std::sqrt(kMostSums / (points * (2 * turns_ + 1)));
    shifts_ = std::min(shifts_, to_whole(0.5 * side * (1 << level), 1, kMostSteps));
    left_ = 2 * static_cast<std::int64_t>(kMostSums / points);
  }

  PlanarPose pose(const Candidate& c) const {
    return {start_.x + c.dx * resolution_, start_.y + c.dy * resolution_,
            wrap_angle(start_.yaw + c.turn * step_)};
  }

  /// Of all layers' points, one layer after the other.
  const std::vector<Cell>& cells(int turn) {
    std::vector<Cell>& cells = cells_[static_cast<std::size_t>(turn + turns_)];
    if (cells.empty()) {
      const PlanarPose T{start_.x, start_.y, start_.yaw + turn * step_};
      const Eigen::Matrix2d R = T.rotation();
      for (const SearchLayer& layer : layers_) {
        for (const Eigen::Vector2d& p : layer.points_scan) {
          const Eigen::Vector2d q = R * p + T.translation();
          cells.push_back({layer.grid->cell_x(q.x()), layer.grid->cell_y(q.y())});
        }
      }
    }
    return cells;
  }

  std::int64_t sum(int level, int turn, int dx, int dy) {
    std::int64_t total = 0;
    --left_;
    const Cell* c = cells(turn).data();
    for (const SearchLayer& layer : layers_) {
      int part = 0;
      for (std::size_t i = 0; i < layer.points_scan.size(); ++i, ++c)
        part += layer.grid->at(level, c->x + dx, c->y + dy);
      total += std::int64_t{layer.weight} * part;
    }
    return total;
  }

  bool excluded(const Candidate& c) const {
    if (!window_.exclude) return false;
    const PlanarPose p = pose(c), e = *window_.exclude;
    return std::hypot(p.x - e.x, p.y - e.y) < window_.exclude_translation &&
           std::abs(wrap_angle(p.yaw - e.yaw)) < window_.exclude_rotation;
  }

  /// Depth first, best bound first, so that later candidates are cut early.
  void descend(std::vector<Candidate>& candidates, int level) {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.sum > b.sum; });
    for (const Candidate& c : candidates) {
      if (c.sum <= best_.sum || left_ <= 0) return;
      if (level == 0) {
        if (excluded(c)) continue;
        best_ = c;
        found_ = true;
        return;
      }
      const int half = 1 << (level - 1);
      std::vector<Candidate> children;
      for (const int dx : {c.dx, c.dx + half}) {
        for (const int dy : {c.dy, c.dy + half}) {
          if (dx > shifts_ || dy > shifts_) continue;
          const Candidate child{c.turn, dx, dy, sum(level - 1, c.turn, dx, dy)};
          if (child.sum > best_.sum) children.push_back(child);
        }
      }
      descend(children, level - 1);
    }
  }

  const std::vector<SearchLayer>& layers_;
  PlanarPose start_;
  SearchWindow window_;
  double resolution_ = 0.1, step_ = 0.01;
  double full_ = 0;  ///< sum of a perfect match
  int levels_ = 1;
  int turns_ = 0, shifts_ = 0;
  std::int64_t left_ = 0;  ///< sums that may be worked out still
  std::vector<std::vector<Cell>> cells_;
  Candidate best_{0, 0, 0, 0};
  bool found_ = false;
};

}  // namespace

std::optional<CorrelativeMatch> search_correlative(const std::vector<SearchLayer>& layers,
                                                   const PlanarPose& start,
                                                   const SearchWindow& window, double min_score) {
  return Search(layers, start, window).run(min_score);
}

std::optional<CorrelativeMatch> search_correlative(const LikelihoodGrid& grid,
                                                   const std::vector<Eigen::Vector2d>& points_scan,
                                                   const PlanarPose& start,
                                                   const SearchWindow& window, double min_score) {
  return search_correlative({{&grid, points_scan, 1}}, start, window, min_score);
}

}  // namespace lamina
