// The model's own formulas.
#include <lamina/sensors/wheel_error_model.hpp>

#include <Eigen/Cholesky>

namespace lamina {

SE3 corrected(const SE3& T_from_to, const WheelErrors::Vector& errors) {
  const Eigen::Vector3d& t = T_from_to.translation();
  const double turn = errors(1) * t.norm() + errors(2) * T_from_to.so3().yaw();
  const SO3 R = SO3::rot_z(turn) * T_from_to.so3();
  const Eigen::Vector3d place(errors(4), errors(5), 0);
  return {R, (1 + errors(0)) * (SO3::rot_z(turn / 2 + errors(3)) * t) + (R * place - place)};
}

double WheelErrors::significance() const { return value.dot(covariance.ldlt().solve(value)); }

}  // namespace lamina
