// Every setting of the program, one table for loading, saving, help and documentation.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <lamina/apps/no_returns.hpp>
#include <lamina/apps/setting.hpp>
#include <lamina/backend/mapper_options.hpp>
#include <lamina/frontend/floor/floor_options.hpp>
#include <lamina/frontend/obstacles/scan_options.hpp>
#include <lamina/frontend/odometry/loop_closer.hpp>
#include <lamina/frontend/odometry/scan_odometry.hpp>
#include <lamina/frontend/segments/segment_options.hpp>

namespace lamina::apps {

struct RobotOptions {
  double height = 0.75;          ///< m, what must fit under overhangs: the document's robot
  double radius = 0.25;          ///< m, of the circle that holds the robot's outline
  double max_step = 0.02;        ///< m, T: the largest step between cells a wheel climbs
  double max_slope = M_PI / 18;  ///< rad, 10 degrees: wheelchair ramps end near 5
};

struct Settings {
  /// "auto", or the preset these began with (preset.hpp).
  std::string preset = "auto";
  int seed = 1;
  int threads = 2;
  double checkpoint_interval = 30;  ///< s
  double grid_resolution = 0.05;    ///< m
  /// ROS bags: which topic to read as what; "" chooses by type.
  std::map<std::string, std::string> topics;
  double sweep = 0;  ///< s from a scan's first beam to its last, where the recording does not say
  /// s that stamps are late by: taken off them
  double scanner_delay = 0, camera_delay = 0, odometry_delay = 0;
  bool find_clocks = true;  ///< offline: turns tell delays
  bool find_sweep = true;   ///< offline: turns tell it where nothing does
  /// Whether a scanner's beams that did not come back met nothing up to its range_max.
  NoReturn no_return_is_free = NoReturn::kAuto;
  RobotOptions robot;
  FloorOptions floor;
  ScanOptions scan;  ///< height, step and slope of the robot are taken from `robot`
  SegmentOptions segments;
  TrackingOptions tracking;
  ScanOdometryOptions scan_odometry;
  bool close_loops = true;           ///< look for places met again by matching scans
  bool calibrate_depth = true;       ///< offline: planes tell a slow bend of the depth image
  bool calibrate_wheels = true;      ///< offline: estimate the wheels' errors first
  bool follow_slopes = true;         ///< images tell height and tilt where the ground slopes
  bool images_beside_wheels = true;  ///< offline: depth images tell the motions wheels told, too
  bool calibrate_mountings = true;   ///< offline: what is seen corrects where sensors sit
  double mounting_sigma_heading_deg = 1.5;  ///< how well stated mountings are known
  double mounting_sigma_place_m = 0.03;
  LoopCloserOptions loops;
  MapperOptions mapper;
};

/// Which topics of a ROS bag are named: role ("scan", "depth", "odom") -> topic.
std::map<std::string, std::string> chosen_topics(const Settings& settings);

/// The settings of the obstacle scans with the robot's own height, step and slope.
ScanOptions scan_options(const Settings& settings);

/// The table, in the order of the documentation.
const std::vector<Setting>& setting_table();

/// Sets one key from text. Throws lamina::Error naming `origin` ("--set", "config.yaml:3"), the key
/// (with the nearest known one when it is unknown), what was found and what was expected.
void set(Settings& settings, const std::string& key, const std::string& value,
         const std::string& origin);
/// "key=value".
void set_assignment(Settings& settings, const std::string& assignment);
/// Reads a YAML file of nested or dotted keys over the settings.
void load(Settings& settings, const std::filesystem::path& file);
/// The same from text; `name` is what messages call it.
void load_text(Settings& settings, const std::string& yaml, const std::string& name);
/// All settings as nested YAML with comments; load() gives the same settings back.
std::string to_yaml(const Settings& settings, bool comments);
/// docs/parameters.md.
std::string to_markdown(const Settings& defaults);
/// All that is wrong with the values together; empty when nothing is.
std::vector<std::string> problems(const Settings& settings);

}  // namespace lamina::apps
