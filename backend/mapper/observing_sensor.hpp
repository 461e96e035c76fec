// Which of the graph's sensors saw something, and what is changed when they turn out to sit
// elsewhere.
#pragma once

#include <vector>

#include <lamina/backend/mapper/map_state.hpp>
#include <lamina/backend/parameters/extrinsics_estimation.hpp>
#include <lamina/models/observation.hpp>

namespace lamina {

/// The graph's state of the sensor that made these observations, new where it is not there: one of
/// the kind within 0.1 m and 10 degrees (self-calibration moves a mounting by less), as
/// T_body_sensor has it. kNone for observations without planes and segments.
ExtrinsicsId observing_sensor(const Observations& observations, Graph& graph);

/// How what was seen moves in the body's frame, T_new_old.
struct SensorMotions {
  SE3 of_scans, of_images;
};

/// Factors, outlines and floor of a map as they would be had these sensors been known to sit as
/// found; refine it afterwards. Outlines of an area, pieces of floor and loose points are of the
/// camera, strokes of the scanner; where there are several of a kind they stay. How views that lie
/// beside the map must be moved.
SensorMotions mount(MapState& map, const std::vector<FoundExtrinsics>& found);

}  // namespace lamina
