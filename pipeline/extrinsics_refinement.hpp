// Where sensors sit, as states of the graph that maps them: all six numbers of each.
#pragma once

#include <functional>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/loops/loop_closer.hpp>
#include <lamina/io/session.hpp>
#include <lamina/models/adoption.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>

namespace lamina {

/// The prior of mountings.sigma_*, the engine of the mapper.
ExtrinsicsOptions extrinsics_options(const CalibrationOptions& settings);

/// Maps the steps, estimates where their sensors sit together with the graph, and corrects steps
/// and loops where the estimate lowers the truncated total by more than its price and maps of
/// blocks of the drive fit better by it than as stated (evidence_by_blocks()). Each number of each
/// sensor goes into the log and into `metrics.calibration`, with what was not observed. `ended`
/// returning true stops early.
void refine_extrinsics(std::vector<Step>& steps, std::vector<LoopClosure>& loops,
                       const CalibrationOptions& settings, Diagnostics& metrics,
                       const std::function<bool()>& ended);

/// The same of a session, by its map and the total alone: what it holds is as it would be had its
/// sensors been known to sit there. Refine its map afterwards.
void refine_extrinsics(io::Session& session, const CalibrationOptions& settings,
                       Diagnostics& metrics, const std::function<bool()>& ended);

/// Six entries a sensor: errors of what is stated along body axes ("lidar.yaw_error_deg",
/// "lidar.x_error_cm"), their sigmas, and whether they were taken out.
void tell_extrinsics(const ExtrinsicsEstimate& estimate, const Adoption& adoption,
                     Diagnostics& metrics);

}  // namespace lamina
