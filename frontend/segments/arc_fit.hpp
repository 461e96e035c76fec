// How well a circle explains a run of returns: what tells a column from a chain of short walls.
#pragma once

#include <optional>
#include <span>

#include <lamina/frontend/segments/scan_points.hpp>

namespace lamina {

/// Chi-squared of the best circle through the returns (three parameters), residuals along the
/// beams. Algebraic fit [Kasa1976] in polar form, r + D cos a + E sin a + F / r = 0, reweighted to
/// range errors. Each return counts at most `cap`. nullopt when there is no such circle.
std::optional<double> arc_cost(const ScanPoints& points, std::span<const int> indices, double cap);

}  // namespace lamina
