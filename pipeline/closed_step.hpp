// A step and the loops that its scan closed.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/loops/loop_closer.hpp>

namespace lamina {

struct ClosedStep {
  Step step;
  std::vector<LoopClosure> loops;
  std::optional<double> closing_ms;  ///< none: the closer was not asked; not archived
};

/// Asks the closer for the loops of a step's scan; null, or a step without a scan: none.
ClosedStep close_loops(Step&& step, LoopCloser* closer);

}  // namespace lamina
