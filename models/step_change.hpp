// Whether what should stay the same changed once on the way.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace lamina {

struct StepChangeOptions {
  std::size_t least = 3;    ///< values on either side
  double least_sigmas = 6;  ///< of the difference of medians: one place of many is chosen
  double least_spread = 2;  ///< times the values' own spread on either side
};

/// Values before and from `at` on, medians, and by how many sigmas these differ.
struct StepChange {
  std::size_t at = 0;
  double before = 0, after = 0, sigmas = 0;
};

/// The place at which values in a row, each of its own (blocks longer than errors are shared for),
/// fall best into two levels; nullopt where none is clear. Medians; spread by mean
/// deviations, the largest tenth left out: a few values may be anything. O(n^2).
std::optional<StepChange> find_step(const std::vector<double>& values,
                                    const StepChangeOptions& options = {});

}  // namespace lamina
