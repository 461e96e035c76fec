// The best line of a run of returns, with its covariance and moments.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lamina/frontend/segments/scan_returns.hpp>
#include <lamina/models/scan_segment.hpp>

namespace lamina {

/// Maximum-likelihood line of the returns `indices` of `points` (their `sums` at hand), in the
/// scanner frame: minimises
///   sum (r_i - rho / cos(a_i - theta))^2 / (sigma_r^2 + (r_i tan(a_i - theta) sigma_a)^2)
/// from the closed form in inverse range as the start. Weighting by [Pfister2003]; the residual is
/// along the beam, where the noise is: distances to the line with noisy foot points bias oblique
/// walls. Returns beyond `outlier_sigma` are left out and added to `rejected`.
///
/// The covariance is the inverse information, raised by the reduced chi-squared where that is
/// significantly above one. `moments` hold each return at the place where its beam meets the line,
/// moved along the normal by its residual: their plane cost is then least at this very line.
/// nullopt when the returns determine no line.
std::optional<ScanSegment> fit_line(const ScanPoints& points, std::span<const int> indices,
                                    const InverseRangeSums& sums, double outlier_sigma,
                                    std::vector<int>& rejected);

}  // namespace lamina
