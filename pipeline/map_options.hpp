// Everything that can be set of a map; pipeline/config/ reads it from YAML and texts.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>

#include <lamina/frontend/loops/loop_closer.hpp>
#include <lamina/grid/grid_options.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/pipeline/stated_scanner.hpp>

namespace lamina {

class Mapper;

struct MapOptions : CalibrationOptions {
  /// "auto", or the preset these began with (pipeline/config/preset.hpp).
  std::string preset = "auto";
  int seed = 1;
  double checkpoint_interval = 30;  ///< s
  double grid_resolution = 0.05;    ///< m
  /// ROS bags: which topic to read as what; "" chooses by type.
  std::map<std::string, std::string> topics;
  /// Whether a scanner's beams that did not come back met nothing up to its range_max.
  NoReturn no_return_is_free = NoReturn::kAuto;
  StatedScanner stated_scanner;  ///< goes over what the recording says
  bool close_loops = true;       ///< look for places met again by matching scans
  bool follow_slopes = true;     ///< images tell height and tilt where the ground slopes
  LoopCloserOptions loops;

  /// Called before the whole graph is refined, offline: a user's own factors and states go in here
  /// (Mapper::add_factor). Not a setting: neither archived nor written.
  std::function<void(Mapper&)> add_factors;

  // Of the run:
  bool online = false;  ///< map step by step, as a robot would have; false: refine the whole graph
  /// Where lists are kept that grow with the recording; nothing stays there.
  std::filesystem::path scratch_folder = std::filesystem::temp_directory_path();
  /// Where a checkpoint is kept that a stopped run goes on from; empty: none.
  std::filesystem::path checkpoint_folder;
  std::string checkpoint_identity;  ///< what else a run must share that goes on from it
  bool resume = false;              ///< go on from the checkpoint
  std::string command;              ///< what the program was called with, for metrics.json
  /// Settings that were given by their former names: a line each.
  std::set<std::string> former_names;
  /// How these are written as YAML, with or without comments, into config.yaml and the session;
  /// null: they are not. pipeline/config sets it.
  std::string (*to_yaml)(const MapOptions& options, bool comments) = nullptr;
};

/// Which topics of a ROS bag are named: role ("scan", "depth", "odom") -> topic.
std::map<std::string, std::string> chosen_topics(const MapOptions& options);

/// What of them the grids need.
GridOptions grid_options(const MapOptions& options);

}  // namespace lamina
