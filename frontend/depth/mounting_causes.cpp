// All that may put a floor elsewhere than the mounting says.
#include <array>
#include <cmath>

#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/frontend/depth/mounting_check.hpp>

namespace lamina {
namespace {

// Focal length of an image twice or half as large, or four times; units of depth for each other.
constexpr std::array kUsualFocals{0.5, 2.0, 0.25, 4.0};
constexpr std::array kUsualDepths{5.0, 0.2, 10.0, 0.1, 2.0, 0.5, 1000.0, 0.001};

// The usual ratio within 4 %; nullopt where there is none.
template <std::size_t N>
std::optional<double> usual(const std::array<double, N>& ratios, double ratio) {
  for (const double one : ratios) {
    if (std::abs(std::log(ratio / one)) < 0.04) return one;
  }
  return std::nullopt;
}

MountingHypothesis other_depth(bool stereo, double ratio, const MountingCheckOptions& options) {
  MountingHypothesis depth;
  depth.id = stereo ? "baseline" : "depth_scale";
  const auto known = usual(kUsualDepths, ratio);
  depth.correction.depth = depth.ratio = known.value_or(ratio);
  depth.price = options.price_known + (known ? 0 : options.price_free);
  return depth;
}

MountingHypothesis other_height(const SE3& stated, double seen,
                                const MountingCheckOptions& options) {
  const Eigen::Vector3d& t = stated.translation();
  MountingHypothesis height;
  height.id = "camera_height";
  height.ratio = seen / t.z();
  height.correction.T_body_camera = SE3(stated.so3(), {t.x(), t.y(), seen});
  height.price = options.price_known + 0.9 * options.price_free;
  return height;
}

}  // namespace

// The factor at which the floor lies as the mounting, turned by R, says: of many the best.
void MountingCheck::add_focal(const Plane& floor, const SO3& R,
                              std::vector<MountingHypothesis>& all) const {
  if (!height_stated_) return;
  constexpr double kMost = 5, kStep = 1.01;
  MountingHypothesis h;
  h.id = "focal_length";
  double best = options_.truncate;
  for (double focal = 1 / kMost; focal < kMost; focal *= kStep) {
    CameraCorrection c;
    c.focal = usual(kUsualFocals, focal).value_or(focal);
    if (R.log().norm() > 0) c.T_body_camera = mounted(T_body_camera_.so3() * R, 0);
    const double misfit = floor_misfit(floor, c, options_.sigma_tilt);
    if (misfit >= best) continue;
    best = misfit;
    h.correction = c;
    h.ratio = c.focal;
  }
  if (best >= options_.truncate || std::abs(std::log(h.ratio)) < 0.2) return;
  h.price = options_.price_known + (usual(kUsualFocals, h.ratio) ? 0 : options_.price_free);
  all.push_back(h);
}

// All that may put the floor there.
void MountingCheck::add_causes(const Plane& floor, std::vector<MountingHypothesis>& all) const {
  const SO3& R = T_body_camera_.so3();
  const double seen = -floor.rho(), stated = T_body_camera_.translation().z();
  const auto turned = [&](const char* id, const SO3& R_body_camera) {
    MountingHypothesis h;
    h.id = id;
    h.correction.T_body_camera = mounted(R_body_camera, seen);
    h.price = options_.price_known + (height_stated_ ? 0 : options_.price_free);
    all.push_back(h);
  };
  turned("camera_upside_down", R * SO3::rot_z(M_PI));
  turned("camera_sideways", R * SO3::rot_z(M_PI / 2));
  turned("camera_sideways", R * SO3::rot_z(-M_PI / 2));
  const Eigen::Vector4d& xyzw = R.quaternion().coeffs();
  turned("quaternion_order", SO3(Eigen::Quaterniond(xyzw(0), xyzw(1), xyzw(2), xyzw(3))));
  if (looks_up()) {
    // The optical frame of a camera that looks along the x of the frame that was stated. Ahead as
    // stated, but seldom without its tilt: that is told by the floor.
    const SE3 T = mounted(R * forward_looking_camera().so3(), seen);
    const Leveling l = leveling_of(T, floor);
    turned("camera_optical_rotation", T.so3());
    if (std::hypot(l.roll, l.pitch) < options_.most_tilt) {
      MountingHypothesis h;
      h.id = "camera_optical_rotation";
      h.correction.T_body_camera = apply(l, T);
      h.price = options_.price_known + 3 * options_.price_free;
      all.push_back(h);
    }
  }
  if (height_stated_ && seen > 0) {
    const MountingHypothesis depth = other_depth(stereo_, stated / seen, options_);
    if (std::abs(std::log(depth.ratio)) > 0.15) all.push_back(depth);
    const MountingHypothesis height = other_height(T_body_camera_, seen, options_);
    if (std::abs(std::log(height.ratio)) > 0.15) all.push_back(height);
  }
  add_focal(floor, SO3(), all);
  if (height_stated_) add_tilted(floor, all);
}

}  // namespace lamina
