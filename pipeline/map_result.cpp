// The end of the line: map, path, grids.
#include <lamina/pipeline/map_result.hpp>

#include <set>

#include <lamina/sensors/recorded_stamps.hpp>

namespace lamina {

void finish_map(MapResult& result, RunObserver& observer) {
  const GridOptions options = grid_options(result.options);
  const TimeLimit limit(*result.record, observer);
  if (observer.hurried()) observer.on_path(result);
  try {
    add_evidence(result.map, *result.record, result.trajectory, options);
    result.grids = build_grids(result.map, *result.record, result.trajectory, options, observer);
  } catch (const EndedEarly&) {
    result.stopped = true;
  }
  Figures& counts = result.diagnostics().counts;
  counts.planes = static_cast<double>(result.map.planes.size());
  counts.path_m = result.trajectory.length();
}

namespace {

Trajectory at_uncorrected_stamps(const Trajectory& trajectory, const MapResult& result) {
  if (!result.clocks.any()) return trajectory;
  std::set<Timestamp> scans;
  result.record->for_each_scan([&scans](const KeptScan& kept) {
    if (!kept.from_depth) scans.insert(kept.scan.stamp);
  });
  return at_recorded_stamps(trajectory, result.clocks, scans);
}

}  // namespace

Trajectory at_recorded_stamps(const Trajectory& trajectory, const MapResult& result) {
  const Trajectory uncorrected = at_uncorrected_stamps(trajectory, result);
  if (result.restamped.empty()) return uncorrected;
  Trajectory stamped;
  for (const auto& [stamp, pose] : uncorrected) {
    const auto recorded = result.restamped.find(stamp);
    stamped.add(recorded == result.restamped.end() ? stamp : recorded->second, pose);
  }
  return stamped;
}

}  // namespace lamina
