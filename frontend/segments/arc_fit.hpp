// How well a circle explains a run of returns: what tells a column, or a wall that bends, from a
// chain of short walls.
#pragma once

#include <optional>
#include <span>

#include <lamina/frontend/segments/scan_returns.hpp>

namespace lamina {

/// The best circle through returns.
struct Arc {
  double cost = 0;         ///< chi-squared, three parameters
  double curvature = 0;    ///< 1/m, >= 0; 0: a line
  double information = 0;  ///< m^2, of the curvature
  bool column = false;     ///< far from any line: only the algebraic fit is any good
};

/// The best circle, residuals along the beams, by maximum likelihood from a line as the start. Each
/// return counts at most `cap`. The cost is that of an algebraic fit [Kasa1976] where that is less
/// (columns); its curvature, which noise biases, is taken only where there is no other. nullopt for
/// less than five returns or where there is no such circle.
std::optional<Arc> fit_arc(const ScanPoints& points, std::span<const int> indices, double cap);

}  // namespace lamina
