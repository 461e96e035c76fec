// The graph over the cells of a grid: where a robot gets from one to the next.
#pragma once

#include <array>
#include <cmath>

#include <lamina/grid/navigability_grid.hpp>

namespace lamina {

/// The 8-connected graph of the floor article, as a view: nothing is copied. Vertices are navigable
/// cells (value above 0); an edge joins neighbours whose heights differ by at most `max_step`.
/// A diagonal step exists only where both cells beside it could be stepped on too: corners are not
/// cut. Where a height is unknown (floor told by a scanner alone) there is no step to be seen.
/// The grid must outlive the view.
class TraversabilityGraph {
 public:
  TraversabilityGraph(const NavigabilityGrid& grid, double max_step)
      : grid_(&grid), max_step_(static_cast<float>(max_step) + 1e-6F) {}

  const NavigabilityGrid& grid() const { return *grid_; }
  bool navigable(const CellIndex& c) const {
    const NavigabilityCell* cell = grid_->find(c);
    return cell != nullptr && cell->navigability > 0;
  }
  /// Symmetric; false for cells that are not neighbours, and for a cell and itself.
  bool edge(const CellIndex& a, const CellIndex& b) const {
    const int di = b.i - a.i, dj = b.j - a.j;
    if (std::abs(di) > 1 || std::abs(dj) > 1 || (di == 0 && dj == 0) || !step(a, b)) return false;
    if (di == 0 || dj == 0) return true;
    for (const CellIndex& beside : {CellIndex{a.i + di, a.j}, CellIndex{a.i, a.j + dj}}) {
      if (!step(a, beside) || !step(beside, b)) return false;
    }
    return true;
  }
  /// visit(CellIndex) for each neighbour there is an edge to, in a fixed order.
  template <class Visit>
  void for_each_neighbour(const CellIndex& c, Visit&& visit) const {
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const CellIndex other{c.i + di, c.j + dj};
        if (edge(c, other)) visit(other);
      }
    }
  }

 private:
  bool step(const CellIndex& a, const CellIndex& b) const {
    const NavigabilityCell *from = grid_->find(a), *to = grid_->find(b);
    if (from == nullptr || to == nullptr) return false;
    return from->navigability > 0 && to->navigability > 0 &&
           !(std::abs(from->height - to->height) > max_step_);
  }
  const NavigabilityGrid* grid_;
  float max_step_;
};

}  // namespace lamina
