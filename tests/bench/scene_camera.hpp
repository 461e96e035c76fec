// A scene seen from poses of one's choice, by its camera with a believed mounting that is off.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include <lamina/sensors/depth_frame.hpp>
#include <lamina/sim/world.hpp>

constexpr double kDegree = M_PI / 180;

/// The renderer refers to the other members: not to be copied.
struct SceneCamera {
  SceneCamera(const std::string& scene, const lamina::sim::Parameters& parameters,
              std::uint64_t seed)
      : world(lamina::sim::make_scene(scene, parameters)),
        caster(world.scene),
        renderer(caster, world.rig.depth->camera, world.rig.depth->effects, seed) {}
  SceneCamera(const SceneCamera&) = delete;
  SceneCamera& operator=(const SceneCamera&) = delete;

  lamina::SE3 T_body_camera() const { return world.rig.depth->camera.camera.T_body_camera; }

  /// Believed mounting: roll, pitch (rad) and height (m) off. Fills `truth`.
  lamina::DepthFrame frame(const lamina::SE3& T_map_body, std::uint64_t index, double roll = 0,
                           double pitch = 0, double height = 0) {
    const lamina::SE3 T_map_camera = T_map_body * T_body_camera();
    truth = renderer.truth(T_map_camera);
    lamina::DepthFrame f = renderer.measure(truth, T_map_camera, lamina::Timestamp(), index);
    lamina::SE3& T = f.camera.camera.T_body_camera;
    T = lamina::SE3(lamina::SO3::exp({roll, pitch, 0}) * T.so3(),
                    T.translation() + Eigen::Vector3d(0, 0, height));
    return f;
  }

  lamina::sim::World world;
  lamina::sim::Caster caster;
  lamina::sim::DepthRenderer renderer;
  lamina::sim::DepthTruth truth;
};
