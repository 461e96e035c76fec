// What is true of a simulated dataset, for those who judge maps of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <lamina/models/planar_map.hpp>
#include <lamina/sim/sim_recording.hpp>

namespace lamina::sim {

struct TruthPlane {
  std::int64_t id = 0;
  std::string name;
  PlaneLabel label = PlaneLabel::kOther;
  Plane plane_map;
  std::vector<Eigen::Vector3d> outline_map;             ///< closed, counter-clockwise
  std::vector<std::vector<Eigen::Vector3d>> holes_map;  ///< openings in it
  double area = 0;                                      ///< m^2
  std::int64_t hits = 0;       ///< measurements (pixels, beams) that fell on it
  std::int64_t sightings = 0;  ///< frames and scans with at least three of them
};

/// One layer; cell (i, j) covers [x0 + i r, x0 + (i + 1) r) and the same in y. Row-major, j rows.
struct TruthGrid {
  double resolution = 0.05, x0 = 0, y0 = 0;  ///< m
  int width = 0, height = 0;                 ///< cells; 0: no grid
  std::vector<float> surface;  ///< height of what a robot would touch, m; NaN: nothing there
  std::vector<float>
      navigability;  ///< 0..1, FORMULAS of docs/grid.md on the true surface; NaN: outside
  std::vector<float> reachable;  ///< 1 where the robot can drive to from its start, else 0

  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(i);
  }
};

/// All in the frame of groundtruth.txt.
struct Truth {
  std::string scene;
  std::uint64_t seed = 0;
  std::vector<TruthPlane> planes;
  std::vector<HoleEdge> hole_edges;
  TruthGrid grid;
};

struct GridRules {
  double resolution = 0.05;    ///< m
  double robot_height = 0.75;  ///< m: what is above does not matter, unless it reaches below
  double max_step = 0.02;      ///< m between neighbouring cells
  double max_slope_deg = 10;   ///< as `robot.max_slope_deg`
};

/// Planes with their hits so far, and hole edges.
Truth truth_of(const Simulation& simulation, std::uint64_t seed);
/// Grid of the ground within 6 m of the path, by casting rays down and across each cell, judged by
/// the rules docs/grid.md states for the product: free is what has no step above max_step to any
/// neighbour, no steeper slope, nothing standing on it, and is no pit; its value falls with the
/// height above the floor the robot comes from. Empty when the path does not start on the ground.
TruthGrid grid_truth(const World& world, const Caster& caster, const GridRules& rules);

/// Writes truth.yaml and the layers as truth_height.pfm, truth_navigability.pfm and
/// truth_reachable.pfm (portable float maps, first row at the least y).
void write_truth(const Truth& truth, const std::filesystem::path& folder);
/// Reads them back; a folder without truth.yaml gives nullopt. Throws lamina::Error naming file and
/// key for one that cannot be read.
std::optional<Truth> read_truth(const std::filesystem::path& folder);

/// A true reading of "floor", "ramp", ...; nullopt for another word.
std::optional<PlaneLabel> label_from(const std::string& word);

}  // namespace lamina::sim
