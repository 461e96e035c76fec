// Which row goes with which column at the least total cost.
#pragma once

#include <limits>
#include <vector>

namespace lamina {

/// A possible pair and what it costs.
struct AssignmentCandidate {
  int row = 0, column = 0;
  double cost = 0;
};

/// The assignment of least total cost when leaving a row or a column alone costs half of
/// `unmatched_cost` each ([Kuhn1955], by shortest augmenting paths [JonkerVolgenant1987]);
/// candidates at or above that cost are never used. Solved apart for each connected group of
/// candidates, so the usual scan costs a few comparisons. Returns the column of each row, or -1.
std::vector<int> assign(int rows, int columns, std::vector<AssignmentCandidate> candidates,
                        double unmatched_cost);

}  // namespace lamina
