// Rectified stereo pairs of a textured scene, so that real stereo matching has work to do.
#pragma once

#include <cstdint>

#include <lamina/sensors/stereo_frame.hpp>
#include <lamina/sim/depth_camera.hpp>

namespace lamina::sim {

/// Grey level (0..1) of the solid noise texture at a point: octaves of value noise down to the
/// wavelength that `footprint` (m a pixel) can carry. The same point looks alike to every camera.
double texture_at(const Eigen::Vector3d& point_map, double footprint, std::uint64_t seed);

/// Draws both images from the exact depth of each camera.
class StereoRenderer {
 public:
  StereoRenderer(const Caster& caster, const StereoCamera& camera, double pixel_noise,
                 std::uint64_t seed);
  /// The exact depth image of the left camera.
  DepthTruth truth(const SE3& T_map_left) const { return depth_.truth(T_map_left); }
  StereoFrame measure(const DepthTruth& left, const SE3& T_map_left, Timestamp stamp,
                      std::uint64_t frame_index) const;
  StereoFrame render(const SE3& T_map_left, Timestamp stamp, std::uint64_t frame_index) const {
    return measure(truth(T_map_left), T_map_left, stamp, frame_index);
  }

 private:
  std::vector<std::uint8_t> paint(const DepthTruth& truth, const SE3& T_map_camera,
                                  std::uint64_t stream) const;

  StereoCamera camera_;
  double pixel_noise_;
  std::uint64_t seed_;
  DepthRenderer depth_;
  NormalTable normals_;
};

}  // namespace lamina::sim
