// The smallest rotation between a floor's normal and z.
#include <lamina/frontend/depth/leveling.hpp>

#include <cmath>

namespace lamina {

Leveling leveling_of(const SE3& T_body_camera, const Plane& floor_camera) {
  const Eigen::Vector3d n = T_body_camera.so3() * floor_camera.normal();
  // n x z = (n.y, -n.x, 0), of length sin(angle).
  const double sine = std::hypot(n.x(), n.y());
  const double angle = std::atan2(sine, n.z());
  Leveling result;
  if (sine > 1e-12) {
    result.roll = angle * n.y() / sine;
    result.pitch = -angle * n.x() / sine;
  } else {
    result.roll = n.z() > 0 ? 0.0 : M_PI;
  }
  result.height = floor_camera.signed_distance(Eigen::Vector3d::Zero());
  return result;
}

SE3 apply(const Leveling& l, const SE3& T_body_camera) {
  const Eigen::Vector3d& t = T_body_camera.translation();
  return SE3(SO3::exp({l.roll, l.pitch, 0}) * T_body_camera.so3(), {t.x(), t.y(), l.height});
}

SE3 leveled(const SE3& T_body_camera, const Plane& floor_camera) {
  return apply(leveling_of(T_body_camera, floor_camera), T_body_camera);
}

}  // namespace lamina
