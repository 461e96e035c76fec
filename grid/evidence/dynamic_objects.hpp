// What was met beside something that had gone later: the rest of people, where nobody looked again.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include <lamina/grid/evidence/occupancy_column.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// A place that a look met.
struct MetPlace {
  PlaceColumn* column = nullptr;
  std::size_t place = 0;
};

/// Takes looks in their order, after all votes have been counted, and counts the places met beside
/// movers: of what a look, or one within 0.3 s of it, met within half a metre, and what either has
/// gone or stood for two seconds, a fifth or more has gone.
class Movers {
 public:
  void add(Timestamp stamp, const std::vector<MetPlace>& met);
  /// After the last look.
  void finish();

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;  // squares of the ground
  struct Count {
    int gone = 0, stood = 0;
  };
  struct Look {
    Timestamp stamp;
    std::map<Cell, Count> cells;
    int gone = 0;                         // in all of them
    std::vector<MetPlace> open;           // not free again, to be told
    mutable std::map<Cell, bool> beside;  // what was asked of it: many places stand in one cell
  };
  void tell(const Look& look);
  bool beside(const Look& look, const Eigen::Vector3d& at_map) const;
  std::deque<Look> looks_;    ///< those near in time of any that is not told
  std::size_t observed_ = 0;  ///< of looks_, the first ones
};

}  // namespace lamina
