// The grids of a map: where a robot may go, and what scans met.
#pragma once

#include <optional>

#include <lamina/grid/grid_options.hpp>
#include <lamina/grid/navigability_grid.hpp>
#include <lamina/grid/occupancy_grid.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/pipeline/run_observer.hpp>
#include <lamina/pipeline/run_record.hpp>

namespace lamina {

struct Grids {
  NavigabilityGrid navigability;
  std::optional<OccupancyGrid> occupancy;  ///< none without scans
};

/// Throws EndedEarly where less than a moment is left for what comes after the grids.
void require_time(const RunObserver& observer);

/// While it lives, lists of the record end by require_time() between two items.
class TimeLimit {
 public:
  TimeLimit(RunRecord& record, const RunObserver& observer) : record_(record) {
    record_.before_each_item([&observer] { require_time(observer); });
  }
  ~TimeLimit() { record_.before_each_item({}); }
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;

 private:
  RunRecord& record_;
};

/// What moved is taken out of `map`, and rims of holes are put into it.
void add_evidence(PlanarMap& map, RunRecord& record, const Trajectory& trajectory,
                  const GridOptions& options);

/// The grids of such a map along its path. Throws EndedEarly.
Grids build_grids(const PlanarMap& map, RunRecord& record, const Trajectory& trajectory,
                  const GridOptions& options, const RunObserver& observer);

}  // namespace lamina
