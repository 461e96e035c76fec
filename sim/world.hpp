// A whole experiment: scene, path, sensors, and what the robot believes of them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/sim/depth_camera.hpp>
#include <lamina/sim/lidar.hpp>
#include <lamina/sim/odometry_sim.hpp>
#include <lamina/sim/path.hpp>
#include <lamina/sim/scene.hpp>

namespace lamina::sim {

struct DepthSensor {
  DepthCamera camera;  ///< as it really is
  DepthEffects effects;
  double rate_hz = 5;
  double delay_s = 0;  ///< its stamps are late by this; negative: early
};

struct StereoSensor {
  StereoCamera camera;     ///< as it really is
  double pixel_noise = 2;  ///< grey levels, 1-sigma
  double rate_hz = 2;
};

struct LidarSensor {
  LidarModel model;  ///< as it really is
  LidarGeometry geometry;
  LidarEffects effects;
  double rate_hz = 10;
  double sweep_s = 0;  ///< from the first beam, at the stamp, to the last; negative: it comes first
  double delay_s = 0;  ///< its stamps are late by this; negative: early
};

struct OdometrySensor {
  OdometryErrors errors;
  double rate_hz = 20;
};

struct AccelerometerSensor {
  double sigma = 0.05;  ///< m/s^2 per axis
  double rate_hz = 50;
};

/// How far the calibration the robot believes is from the truth, applied to every sensor's
/// mounting: believed T_body_sensor = true T_body_sensor, turned about the sensor's origin by
/// angles about the body's axes and moved along them.
struct MountingError {
  Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();  ///< roll, pitch, yaw
  Eigen::Vector3d translation_cm = Eigen::Vector3d::Zero();

  SE3 apply(const SE3& T_body_sensor) const;
};

struct Rig {
  std::optional<DepthSensor> depth;
  std::optional<StereoSensor> stereo;
  std::optional<LidarSensor> lidar;
  std::optional<OdometrySensor> odometry;
  std::optional<AccelerometerSensor> accelerometer;
  MountingError mounting_error;
  double focal_error = 0;  ///< share by which the depth camera's focal length is believed too long
  OdometryModel assumed_odometry;

  /// What the robot is told: mountings with mounting_error, and that focal length.
  Calibration accepted() const;
};

struct World {
  std::string name, description;
  Scene scene;
  Path path;
  Rig rig;
  double start_time = 1000;    ///< s, stamp of the first measurement
  double robot_height = 0.75;  ///< m: what is above does not matter to the ground's truth
};

using Parameters = std::map<std::string, std::string>;

/// Names and one-line descriptions of the built-in worlds, in a fixed order.
std::vector<std::pair<std::string, std::string>> scene_list();
/// A built-in world; `parameters` override its numbers (docs/simulator.md lists the keys). Throws
/// lamina::Error for an unknown name or key, with the nearest known one, and for bad values.
World make_scene(const std::string& name, const Parameters& parameters = {});

/// A built-in world by name, or one described in a YAML file (docs/simulator.md, "Scene files")
/// when `scene` ends in .yaml or .yml. Throws lamina::Error naming file, line, key and the nearest
/// known.
World load_scene(const std::string& scene, const Parameters& parameters = {});

/// Mounting of a camera on a body: optical frame, looking forward, then turned by yaw, pitch
/// (positive: down) and roll about the body's axes.
SE3 mount_camera(const Eigen::Vector3d& position_body, double yaw, double pitch, double roll);
/// 640x480 Kinect-like camera of focal length 525 px (FORMATS' example).
DepthCamera kinect_camera(const SE3& T_body_camera);

}  // namespace lamina::sim
