// Writes a simulated recording as a dataset folder with its truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include <lamina/sim/bag_writer.hpp>
#include <lamina/sim/sim_recording.hpp>

namespace lamina::sim {

struct DatasetOptions {
  std::uint64_t seed = 1;
  DatasetFormat format = DatasetFormat::kFolder;  ///< but labels, which are files in any case
  bool labels = false;            ///< labels/: plane of each depth pixel (id + 1; 0: none)
  bool grid = true;               ///< truth grids, for robots on the ground
  double grid_resolution = 0.05;  ///< m
  double max_duration = 0;        ///< s; 0: the whole path
  /// Called after every measurement with (done, all); may be empty. Returning false stops there,
  /// and what was measured so far is written completely.
  std::function<bool(std::int64_t, std::int64_t)> progress;
};

struct DatasetCounts {
  std::int64_t depth_frames = 0, stereo_pairs = 0, scans = 0, odometry = 0, accelerometer = 0;
};

/// As a bag, depth, scans, odometry and accelerometer are topics of recording.bag or of the ROS 2
/// folder recording in place of their files; stereo pairs are refused.
/// Drives the world and writes calibration.yaml (what the robot believes), depth.txt, left.txt,
/// right.txt, scans.csv, odometry.txt, accelerometer.txt, groundtruth.txt, truth.yaml with its
/// grids, and calibration_true.yaml. The same world and options give the same bytes. Throws
/// lamina::Error when the folder cannot be written.
DatasetCounts write_dataset(World world, const std::filesystem::path& folder,
                            const DatasetOptions& options = {});

/// calibration.yaml's text.
std::string to_yaml(const Calibration& calibration);

}  // namespace lamina::sim
