// A map that grows with each measurement: for one's own sensor loop.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <lamina/backend/mapper/online_maintenance.hpp>
#include <lamina/pipeline/build_grid.hpp>
#include <lamina/pipeline/calibration/extrinsics_uncertainty.hpp>
#include <lamina/pipeline/map_steps.hpp>

namespace lamina {

/// Steps mapped online: each in the window, the whole graph when it is due.
class OnlineSteps {
 public:
  OnlineSteps(const MapOptions& options, const LoopCloser& closer, RunRecord& record);

  /// A step, the loops that its scan closed, and whether wheels measure motions.
  void add(const Step& step, const std::vector<LoopClosure>& loops, bool wheels);
  const Mapper& mapper() const { return mapping_.mapper; }
  Mapper& mapper() { return mapping_.mapper; }
  std::int64_t plane_count() const { return mapping_.plane_count(); }
  /// To a mapper of this state: what is unknown of where sensors sit.
  void report_uncertainty(Mapper& mapper) const { uncertainty_.tell(mapper, record_.diagnostics); }
  /// Nothing comes any more; `hurried`: the map is left as it is.
  Mapper finish(bool hurried);

 private:
  void refine();

  StepMapper mapping_;
  OnlineUpkeep upkeep_;
  ExtrinsicsUncertainty uncertainty_;
  RunRecord& record_;
  int keyframes_ = 0;
};

/// What `lamina map --mode online` does of a recording, of measurements as they come: stamps never
/// go back. Not thread-safe. Nothing is looked at ahead: sensors are taken as calibrated.
class OnlineMapper {
 public:
  OnlineMapper(const Calibration& calibration, const MapOptions& options);
  OnlineMapper(const OnlineMapper&) = delete;
  OnlineMapper& operator=(const OnlineMapper&) = delete;

  /// T_map_body at a scan or image; nullopt for measurements that make no step of their own
  /// (odometry), or that could not be used (diagnostics().skipped counts them).
  std::optional<SE3> add(const Measurement& measurement);
  /// A user's own factors and states (Mapper::add_factor, add_state, keyframe_at): in the window
  /// while their keyframes are there, and whenever the whole graph is refined.
  Mapper& mapper() { return steps_.mapper(); }
  /// Planes, surfels and path as they are now.
  PlanarMap map() const { return steps_.mapper().map(); }
  /// Where a robot may go, by all that was seen so far: a second or so of work for a building.
  Grids grid();
  /// Every file of a map (write_results), as of now.
  void save(const std::filesystem::path& folder);
  /// Figures and warnings so far, and what was left out.
  Diagnostics diagnostics() const;

 private:
  MapOptions options_;
  FrontEnd front_end_;
  LoopCloser closer_;
  std::shared_ptr<RunRecord> record_;
  OnlineSteps steps_;
  Calibration calibration_;
};

}  // namespace lamina
