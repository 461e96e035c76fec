// Refinement to the last digits, for comparing engines.
#pragma once

#include <lamina/backend/refine/refiner.hpp>

namespace lamina::test {

inline RefineOptions exact(SolverEngine engine) {
  RefineOptions options;
  options.engine = engine;
  options.minimizer.chi2_tolerance = 1e-9;
  options.minimizer.relative_tolerance = 1e-12;
  return options;
}

}  // namespace lamina::test
