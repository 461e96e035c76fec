// Table of built-in worlds, cameras and mountings.
#include <lamina/sim/world.hpp>

#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/sim/builtin.hpp>
#include <lamina/sim/settings.hpp>

namespace lamina::sim {
namespace {

struct Entry {
  const char* name;
  const char* description;
  void (*build)(Settings&, World&);
};

constexpr Entry kScenes[] = {
    {"room", "a furnished room, one lap; depth camera, lidar, wheels", build_room},
    {"flat", "level floor without end, straight drive; depth camera, wheels", build_flat},
    {"steps", "platforms of 2, 3, 5 and 10 cm and a 5 degree ramp; depth camera, wheels",
     build_steps},
    {"plates", "plates of 20 x 20 cm, 1 and 2 cm thick, at 1 to 3 m; depth camera, wheels",
     build_plates},
    {"obstacle_bed", "boxes and slopes of many heights from 1 to 5.5 m; depth camera, wheels",
     build_obstacle_bed},
    {"hole", "a 2 x 2 m hole in a slab, a wall behind it; low level depth camera, wheels",
     build_hole},
    {"hole_no_wall", "the same hole with nothing behind and no ground below", build_hole_no_wall},
    {"stairs_down", "stairs down behind a railing; low level depth camera, wheels",
     build_stairs_down},
    {"corridor_loop", "two laps of a square corridor; depth camera, lidar, drifting wheels",
     build_corridor_loop},
    {"ramp", "two halls joined by a ramp of 5 degrees; depth camera, lidar, drifting wheels",
     build_ramp},
    {"uneven", "a hall whose floor swells by centimetres; depth camera, wheels", build_uneven},
    {"office", "many rooms along a hall; depth camera, lidar, drifting wheels", build_office},
    {"flyover", "an aircraft with a downward lidar over gabled buildings, 54 observed planes",
     build_flyover},
    {"roof_ridge", "a gabled roof flown over along its ridge's normal (ridge.off_deg: beside it)",
     build_roof_ridge},
    {"lost_altitude", "three good poses over level ground, then 50 m of altitude error",
     build_lost_altitude},
    {"lost_roll", "three good poses over level ground, then 22 degrees of roll error",
     build_lost_roll},
    {"side_laser", "a court between houses driven round, an upright laser on the robot's left side",
     build_side_laser},
    {"long_corridor", "an hour up and down a corridor; depth camera, lidar, wheels",
     build_long_corridor},
};

}  // namespace

SE3 MountingError::apply(const SE3& T_body_sensor) const {
  const Eigen::Vector3d w = rotation_deg * (3.14159265358979323846 / 180);
  const SO3 R = SO3::rot_z(w.z()) * SO3::rot_y(w.y()) * SO3::rot_x(w.x());
  return SE3(R * T_body_sensor.so3(), T_body_sensor.translation() + translation_cm / 100);
}

Calibration Rig::accepted() const {
  Calibration out;
  if (depth) {
    out.depth_camera = depth->camera;
    CameraModel& camera = out.depth_camera->camera;
    camera.T_body_camera = mounting_error.apply(camera.T_body_camera);
    camera.fx *= 1 + focal_error;
    camera.fy *= 1 + focal_error;
  }
  if (stereo) {
    out.stereo_camera = stereo->camera;
    SE3& T = out.stereo_camera->camera.T_body_camera;
    T = mounting_error.apply(T);
  }
  if (lidar) {
    out.lidar = lidar->model;
    out.lidar->T_body_lidar = mounting_error.apply(lidar->model.T_body_lidar);
  }
  out.odometry = assumed_odometry;
  return out;
}

SE3 mount_camera(const Eigen::Vector3d& position_body, double yaw, double pitch, double roll) {
  Eigen::Matrix3d R_body_optical;
  R_body_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return SE3(
      SO3::rot_z(yaw) * SO3::rot_y(pitch) * SO3::rot_x(roll) * SO3::from_matrix(R_body_optical),
      position_body);
}

DepthCamera kinect_camera(const SE3& T_body_camera) {
  DepthCamera camera;
  camera.camera = {640, 480, 525, 525, 319.5, 239.5, std::nullopt, T_body_camera};
  camera.depth_scale = 5000;
  camera.noise = DepthNoise::kinect(525);
  return camera;
}

std::vector<std::pair<std::string, std::string>> scene_list() {
  std::vector<std::pair<std::string, std::string>> out;
  for (const Entry& entry : kScenes) {
    out.emplace_back(entry.name, entry.description);
  }
  return out;
}

World make_scene(const std::string& name, const Parameters& parameters) {
  std::vector<std::string> names;
  for (const Entry& entry : kScenes) {
    names.push_back(entry.name);
    if (name == entry.name) {
      World world;
      world.name = name;
      world.description = entry.description;
      Settings settings(name, parameters);
      entry.build(settings, world);
      settings.finish();
      return world;
    }
  }
  const std::string hint = nearest_name(name, names);
  throw input_error("scene", "", '"' + name + '"',
                    hint.empty() ? "a built-in scene (lamina simulate --list)"
                                 : "a known one: did you mean '" + hint + "'?");
}

}  // namespace lamina::sim
