// Sensors and where they sit: calibration.yaml.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/sensors/noise.hpp>

namespace lamina {

/// Pinhole camera; pixel (u, v) at depth z is ((u - cx) z / fx, (v - cy) z / fy, z) in its optical
/// frame (z forward, x right, y down).
struct CameraModel {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;            ///< px
  std::optional<std::array<double, 5>> distortion;  ///< k1 k2 p1 p2 k3 (Brown-Conrady)
  SE3 T_body_camera;
};

struct DepthCamera {
  CameraModel camera;
  double depth_scale = 1000;  ///< raw units per metre
  DepthNoise noise;
};

struct StereoCamera {
  CameraModel camera;             ///< of the left image; the right is the same, moved by baseline
  double baseline = 0;            ///< m
  double disparity_sigma = 0.25;  ///< px
};

struct LidarModel {
  LidarNoise noise;
  SE3 T_body_lidar;
};

/// Random walk of odometry: sigmas grow with the square root of what was travelled.
struct OdometryModel {
  double sigma_translation = 0.02;    ///< m per sqrt(m) travelled
  double sigma_rotation = 0.02;       ///< rad per sqrt(m)
  double sigma_rotation_turn = 0.05;  ///< rad per sqrt(rad) turned
  bool planar = true;                 ///< wheels on a floor
};

struct Calibration {
  std::optional<DepthCamera> depth_camera;
  std::optional<StereoCamera> stereo_camera;
  std::optional<LidarModel> lidar;
  OdometryModel odometry;
  bool odometry_given = false;       ///< the file has an odometry section
  std::vector<std::string> remarks;  ///< what was defaulted, for `lamina info`
};

/// T_body_camera of an optical frame at the body's origin that looks along body x: what is assumed
/// of a camera whose place nothing tells.
SE3 forward_looking_camera();

/// Reads calibration.yaml (docs/formats.md). Throws lamina::Error naming file, key, what was found
/// and what was expected; an unknown key is an error that suggests the nearest.
Calibration read_calibration(const std::filesystem::path& file);
/// The same for a text; `file` is the name used in messages.
Calibration parse_calibration(const std::string& text, const std::string& file);

}  // namespace lamina
