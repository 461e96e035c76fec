// What a camera sees of boxes in a hall, for tests of lines of sight.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <lamina/frontend/obstacles/coarse_depth.hpp>
#include <lamina/grid/evidence/dynamic_removal.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

struct Box {
  Eigen::Vector3d low, high;
};

/// A hall with floor and a wall at x = 5 (m, map frame).
struct BoxHall {
  std::vector<Box> boxes;
  bool blind_tops = false;  ///< tops and undersides return nothing

  /// Along `ray` (of z 1 in the camera's frame); 0: nothing comes back.
  double depth(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) const {
    double t = (5 - from.x()) / ray.x();
    if (ray.z() < 0) t = std::min(t, -from.z() / ray.z());
    bool blind = false;
    for (const Box& box : boxes) {
      const Eigen::Array3d a = (box.low - from).array() / ray.array(),
                           b = (box.high - from).array() / ray.array();
      Eigen::Index face = 0;
      const double in = a.min(b).maxCoeff(&face), out = a.max(b).minCoeff();
      if (!(in > 0 && in < out && in < t)) continue;
      t = in;
      blind = blind_tops && face == 2;
    }
    return blind ? 0 : t;
  }
  /// From 0.6 m above (x, 0), along x and down by `pitch` (rad).
  DepthFrame image(double x, double pitch) const {
    DepthFrame frame;
    CameraModel& camera = frame.camera.camera;
    camera.width = 160;
    camera.height = 120;
    camera.fx = camera.fy = 133.3;
    camera.cx = 79.5;
    camera.cy = 59.5;
    Eigen::Matrix3d R;
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    camera.T_body_camera =
        SE3(SO3::exp({0, pitch, 0}) * SO3(Eigen::Quaterniond(R)), Eigen::Vector3d(0, 0, 0.6));
    frame.camera.noise = DepthNoise::kinect(133.3);
    for (int v = 0; v < 120; ++v) {
      for (int u = 0; u < 160; ++u) {
        const Eigen::Vector3d ray =
            camera.T_body_camera.so3() * Eigen::Vector3d((u - 79.5) / 133.3, (v - 59.5) / 133.3, 1);
        const double z = depth(Eigen::Vector3d(x, 0, 0.6), ray);
        frame.raw.push_back(static_cast<std::uint16_t>(std::lround(z * 1000)));
      }
    }
    return frame;
  }
};

/// Looks at a hall, four a second, and the path they were taken along.
struct Looks {
  SightVotes votes;
  Trajectory path;

  void add(const DepthFrame& frame, double x, int images) {
    const DepthLook look = depth_look(frame);
    for (int i = 0; i < images; ++i) {
      const auto stamp =
          Timestamp::from_nanoseconds(static_cast<std::int64_t>(path.size()) * 250'000'000);
      votes.add(stamp, look, frame.camera.camera.T_body_camera);
      path.add(stamp, SE3::from_translation({x, 0, 0}));
    }
  }
};

}  // namespace lamina
