// A depth camera: exact images of a scene, and what a Kinect or a stereo camera makes of them.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/sensors/depth_frame.hpp>
#include <lamina/sim/caster.hpp>
#include <lamina/sim/random.hpp>

namespace lamina::sim {

/// What really is in front of each pixel, row-major.
struct DepthTruth {
  int width = 0, height = 0;
  std::vector<float> inverse_depth;   ///< 1/Z (1/m); 0 where the ray leaves the scene
  std::vector<std::int32_t> surface;  ///< Caster's surface number; -1 where there is none

  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(u);
  }
};

/// Effects of a real sensor; every one has its switch. The order is that of the physics: where a
/// pixel looks (lateral), what it can see (shadow, grazing), disparity and its noise, quantisation.
struct DepthEffects {
  bool noise = true;       ///< disparity noise; its total sigma, with quantisation, is the model's
  bool correlated = true;  ///< smooth that noise over the model's correlation_px
  bool quantise = true;    ///< to the model's disparity_step
  bool lateral = true;     ///< pixels look N(0, lateral_sigma_px) beside themselves, both axes
  bool shadow = true;      ///< no measurement where the projector or second camera cannot see
  bool grazing = true;     ///< drop-out around grazing_deg of incidence
  bool distortion = true;  ///< slow spatial bias of the disparity, the same in every frame
  double lateral_sigma_px = 0.5;    ///< px [Barron2013]
  double grazing_deg = 80;          ///< deg from the normal; half of the pixels are lost there
  double grazing_band_deg = 2;      ///< deg; nothing is lost below, all is lost above this band
  double distortion_sigma_px = -1;  ///< px of disparity; negative: the model's disparity_floor
  double slope_px =
      0;  ///< of the distortion: px of disparity from the left of the image to the right
  double dropout = 0;  ///< probability that a pixel has no measurement, anywhere

  static DepthEffects none();
};

/// Draws the planar faces of a scene by their projections: inverse depth of a plane is linear in
/// the pixel, so the image is exact and costs a multiplication a pixel (bench: sim_bench).
/// Cylinders and meshes are cast ray by ray inside their bounds.
class DepthRenderer {
 public:
  DepthRenderer(const Caster& caster, const DepthCamera& camera, const DepthEffects& effects,
                std::uint64_t seed);

  /// The exact image from a pose of the camera (optical frame).
  DepthTruth truth(const SE3& T_map_camera) const;
  /// What the sensor measures of that image. `frame_index` chooses the noise.
  DepthFrame measure(const DepthTruth& truth, const SE3& T_map_camera, Timestamp stamp,
                     std::uint64_t frame_index) const;
  DepthFrame render(const SE3& T_map_camera, Timestamp stamp, std::uint64_t frame_index) const {
    return measure(truth(T_map_camera), T_map_camera, stamp, frame_index);
  }
  /// Slow bias of the disparity (px) of each pixel, as `measure` adds it; zeros when switched off.
  const std::vector<float>& distortion() const { return distortion_; }
  const DepthCamera& camera() const { return camera_; }

 private:
  struct Linear {  ///< inverse depth = at0 + du * u + dv * v
    double du = 0, dv = 0, at0 = 0;
    double rho = 0;  ///< plane's distance from the camera, for the incidence angle
  };
  Linear linear_of(const Plane& plane_camera) const;
  void draw_face(const Face& face, std::int32_t surface, const SE3& T_camera_map,
                 DepthTruth& out) const;
  void draw_cylinder(const Cylinder& cylinder, std::int32_t surface, const SE3& T_map_camera,
                     DepthTruth& out) const;
  void draw_meshes(const SE3& T_map_camera, DepthTruth& out) const;
  void fill_noise(std::uint64_t frame_index, std::vector<float>& noise) const;
  void sample(const DepthTruth& truth, const std::vector<Linear>& linear, std::uint64_t frame_index,
              std::vector<float>& inverse) const;
  void drop_grazing(const DepthTruth& truth, const std::vector<Linear>& linear,
                    std::uint64_t frame_index, std::vector<float>& inverse) const;
  void drop_shadow(const DepthTruth& truth, std::vector<float>& inverse) const;
  void quantise(const std::vector<float>& inverse, const std::vector<float>& noise,
                DepthFrame& frame) const;

  const Caster* caster_;
  DepthCamera camera_;
  DepthEffects effects_;
  std::uint64_t seed_;
  double added_sigma_ = 0;  ///< px: what is left of the model's sigma after quantisation
  NormalTable normals_;
  std::vector<float> kernel_;      ///< smoothing kernel, unit energy
  std::vector<float> distortion_;  ///< px
  std::vector<float> ray_length_;  ///< |((u - cx)/fx, (v - cy)/fy, 1)|
};

/// Half of a Gaussian kernel (first element: the middle), of unit energy, whose smoothing of white
/// noise leaves correlations that sum to correlation_px over all lags of a row: the mean of n
/// pixels then has the variance of n / correlation_px independent ones. White for correlation_px
/// <= 1.
std::vector<float> correlation_kernel(double correlation_px);

}  // namespace lamina::sim
