// Random walk of dead reckoning.
#include <lamina/sensors/odometry.hpp>

#include <cmath>

namespace lamina {
namespace {
// A standing robot's encoders still tell it no better than this.
constexpr double kSmallestTranslation = 5e-4;  // m
constexpr double kSmallestRotation = 5e-4;     // rad
// Wheels on a floor: what the floor's own unevenness and the suspension let through.
constexpr double kPlanarHeight = 2e-3;  // m per sqrt(m)
constexpr double kPlanarTilt = 5e-3;    // rad per sqrt(m)
}  // namespace

Matrix6d increment_covariance(const OdometryModel& model, const SE3& T_from_to) {
  const double distance = T_from_to.translation().norm();
  const double turn = T_from_to.so3().log().norm();
  const auto square = [](double x) { return x * x; };
  const double translation =
      square(kSmallestTranslation) + square(model.sigma_translation) * distance;
  const double rotation = square(kSmallestRotation) + square(model.sigma_rotation) * distance +
                          square(model.sigma_rotation_turn) * turn;
  Vector6d variance;
  variance.head<3>().setConstant(translation);
  variance.tail<3>().setConstant(rotation);
  if (model.planar) {
    variance[2] = square(kSmallestTranslation) + square(kPlanarHeight) * distance;
    variance[3] = variance[4] = square(kSmallestRotation) + square(kPlanarTilt) * distance;
  }
  return variance.asDiagonal();
}

}  // namespace lamina
