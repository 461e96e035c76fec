// Bit tiles, strokes and polygons into cells, and the tracing of borders.
#include <lamina/models/outline_grid.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

using Cell = OutlineGrid::Cell;
constexpr double kFarthestCell = 1e9;

Cell tile_of(const Cell& cell) { return {cell.first >> 3, cell.second >> 3}; }

std::uint64_t bit_of(const Cell& cell) {
  return std::uint64_t{1} << (8 * (cell.first & 7) + (cell.second & 7));
}

std::optional<Cell> cell_at(const Eigen::Vector2d& point, double cell_size) {
  const Eigen::Array2d index = (point / cell_size).array().floor();
  if (!(index.abs() < kFarthestCell).all()) return std::nullopt;  // also when not finite
  return Cell(static_cast<std::int32_t>(index.x()), static_cast<std::int32_t>(index.y()));
}

// Where a row of cell centres crosses the polygon's border, ascending.
std::vector<double> crossings(const std::vector<Eigen::Vector2d>& v, double y) {
  std::vector<double> xs;
  for (std::size_t i = 0, j = v.size() - 1; i < v.size(); j = i++) {
    if ((v[i].y() > y) == (v[j].y() > y)) continue;
    xs.push_back((v[j].x() - v[i].x()) * (y - v[i].y()) / (v[j].y() - v[i].y()) + v[i].x());
  }
  std::sort(xs.begin(), xs.end());
  return xs;
}

// Grown by a square of `reach` cells, then shrunk by the same: gaps close, borders stay.
OutlineGrid closed(const OutlineGrid& grid, int reach) {
  // Squares are taken apart into a row and a column.
  const auto grown_along = [reach](const OutlineGrid& from, int di, int dj) {
    OutlineGrid to(from.cell_size());
    for (const auto& [i, j] : from.cells()) {
      for (int k = -reach; k <= reach; ++k) to.add_cell({i + k * di, j + k * dj});
    }
    return to;
  };
  const auto shrunk_along = [reach](const OutlineGrid& from, int di, int dj) {
    OutlineGrid to(from.cell_size());
    for (const auto& [i, j] : from.cells()) {
      bool all = true;
      for (int k = -reach; k <= reach && all; ++k) {
        all = from.contains_cell({i + k * di, j + k * dj});
      }
      if (all) to.add_cell({i, j});
    }
    return to;
  };
  const OutlineGrid grown = grown_along(grown_along(grid, 1, 0), 0, 1);
  return shrunk_along(shrunk_along(grown, 1, 0), 0, 1);
}

// Follows a border with its cells on the left, from the lower edge of `start`, and gives its
// corners. Lower edges that were passed are noted in `passed`.
std::vector<Eigen::Vector2d> trace(const OutlineGrid& grid, const Cell& start,
                                   OutlineGrid& passed) {
  std::vector<Eigen::Vector2d> corners;
  std::int32_t x = start.first, y = start.second;  // lattice point: lower left corner of a cell
  int dx = 1, dy = 0;
  do {
    if (dx == 1) passed.add_cell({x, y});
    x += dx;
    y += dy;
    // The two cells ahead of the lattice point just reached, left and right of the way.
    const bool left = grid.contains_cell({x + (dx - dy - 1) / 2, y + (dx + dy - 1) / 2});
    const bool right = grid.contains_cell({x + (dx + dy - 1) / 2, y + (dy - dx - 1) / 2});
    if (left && !right) continue;
    corners.emplace_back(x * grid.cell_size(), y * grid.cell_size());
    // Cells that touch by a corner alone are not connected: the turn left stays with one cell.
    const int turn = left ? -1 : 1;
    const int was_dx = dx;
    dx = -turn * dy;
    dy = turn * was_dx;
  } while (x != start.first || y != start.second || dx != 1);
  return corners;
}

}  // namespace

void OutlineGrid::add_cell(const Cell& cell) {
  std::uint64_t& tile = tiles_[tile_of(cell)];
  const std::uint64_t bit = bit_of(cell);
  if (!(tile & bit)) ++size_;
  tile |= bit;
}

bool OutlineGrid::contains_cell(const Cell& cell) const {
  const auto it = tiles_.find(tile_of(cell));
  return it != tiles_.end() && (it->second & bit_of(cell));
}

void OutlineGrid::add(const Eigen::Vector2d& point) {
  if (const auto cell = cell_at(point, cell_size_)) add_cell(*cell);
}

bool OutlineGrid::contains(const Eigen::Vector2d& point) const {
  const auto cell = cell_at(point, cell_size_);
  return cell && contains_cell(*cell);
}

// From border to border of cells along the stroke: [Amanatides1987].
void OutlineGrid::add_stroke(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const auto first = cell_at(a, cell_size_), last = cell_at(b, cell_size_);
  if (!first || !last) return;
  Cell at = *first;
  add_cell(at);
  const Eigen::Vector2d from = a / cell_size_, d = (b - a) / cell_size_;
  const int step_i = d.x() > 0 ? 1 : -1, step_j = d.y() > 0 ? 1 : -1;
  const auto crossing = [](double distance, double speed) {
    return speed == 0 ? std::numeric_limits<double>::infinity() : distance / speed;
  };
  std::int64_t left = std::abs(std::int64_t{last->first} - at.first) +
                      std::abs(std::int64_t{last->second} - at.second);
  for (; left > 0; --left) {
    const double next_i = crossing(at.first + (step_i > 0 ? 1 : 0) - from.x(), d.x());
    const double next_j = crossing(at.second + (step_j > 0 ? 1 : 0) - from.y(), d.y());
    const bool along_i = at.second == last->second || (at.first != last->first && next_i < next_j);
    if (along_i) {
      at.first += step_i;
    } else {
      at.second += step_j;
    }
    add_cell(at);
  }
}

void OutlineGrid::add(const Polygon& polygon) {
  if (polygon.empty()) return;
  const auto [low, high] = polygon.bounds();
  const auto first = cell_at(low, cell_size_), last = cell_at(high, cell_size_);
  if (!first || !last) return;
  for (std::int32_t j = first->second; j <= last->second; ++j) {
    const std::vector<double> xs = crossings(polygon.vertices(), (j + 0.5) * cell_size_);
    for (std::size_t k = 0; k + 1 < xs.size(); k += 2) {
      const auto begin = static_cast<std::int32_t>(std::ceil(xs[k] / cell_size_ - 0.5));
      const auto end = static_cast<std::int32_t>(std::floor(xs[k + 1] / cell_size_ - 0.5));
      for (std::int32_t i = begin; i <= end; ++i) add_cell({i, j});
    }
  }
}

void OutlineGrid::merge(const OutlineGrid& other) {
  if (other.cell_size_ == cell_size_) {
    for (const auto& [key, bits] : other.tiles_) {
      std::uint64_t& tile = tiles_[key];
      size_ += static_cast<std::size_t>(std::popcount(bits & ~tile));
      tile |= bits;
    }
    return;
  }
  for (const auto& [i, j] : other.cells()) {
    const Eigen::Vector2d low = other.cell_size_ * Eigen::Vector2d(i, j);
    const Eigen::Vector2d high = low + Eigen::Vector2d::Constant(other.cell_size_);
    add(0.5 * (low + high));
    if (auto square =
            Polygon::from_vertices({low, {high.x(), low.y()}, high, {low.x(), high.y()}})) {
      add(*square);
    }
  }
}

std::vector<Cell> OutlineGrid::cells() const {
  std::vector<Cell> all;
  all.reserve(size_);
  for (const auto& [key, bits] : tiles_) {
    for (std::uint64_t rest = bits; rest != 0; rest &= rest - 1) {
      const int bit = std::countr_zero(rest);
      all.emplace_back(8 * key.first + bit / 8, 8 * key.second + bit % 8);
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<Polygon> OutlineGrid::outlines(int close_cells) const {
  const OutlineGrid grid = close_cells > 0 ? closed(*this, close_cells) : *this;
  OutlineGrid passed(cell_size_);
  std::vector<Polygon> result;
  for (const Cell& cell : grid.cells()) {
    if (grid.contains_cell({cell.first, cell.second - 1}) || passed.contains_cell(cell)) continue;
    const std::vector<Eigen::Vector2d> corners = trace(grid, cell, passed);
    double twice_area = 0;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      const Eigen::Vector2d a = corners[i] - corners[0], b = corners[i + 1] - corners[0];
      twice_area += a.x() * b.y() - a.y() * b.x();
    }
    if (twice_area <= 0) continue;  // the border of a hole
    if (auto polygon = Polygon::from_vertices(corners)) {
      result.push_back(polygon->simplified(0.75 * cell_size_));
    }
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Polygon& a, const Polygon& b) { return a.area() > b.area(); });
  return result;
}

}  // namespace lamina
