// A plane that turns out to be two: what the refiner rejects may agree among itself.
#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {

struct SplitOptions {
  int min_observations = 3;        ///< fewer rejected views are outliers, not a plane
  double gate_chi_squared = 16.3;  ///< of each view against the new plane, 3 degrees, 99.9 %
  double max_angle_deg = 60;       ///< between the two sides: both were seen from the same side
  /// Whether these factors (indices) may make a plane apart from the one they leave; none: always.
  std::function<bool(PlaneId old, const Plane& made_map, std::span<const std::size_t> views)>
      accept = {};
};

/// For every plane with rejected observations that fit one other plane: makes that plane, gives it
/// the observations that fit with full weight, and returns (old, new). A segment of a roof that is
/// flown over along its ridge's normal goes from one side to the other unnoticed; here it is
/// noticed.
std::vector<std::pair<PlaneId, PlaneId>> split_rejected(Graph& graph,
                                                        std::span<const FactorRef> rejected,
                                                        const SplitOptions& options = {});

}  // namespace lamina
