// Six sigmas, and the camera's own place.
#include <lamina/pipeline/calibration/calibration_priors.hpp>

#include <Eigen/LU>

namespace lamina {
namespace {

using Vector = WheelErrors::Vector;
using Matrix = WheelErrors::Matrix;
constexpr int kDirection = 3, kPlace = 4;
constexpr double kNone = 1e-5;  // a sigma: as calibrated
constexpr double kPlaceObserved = 13.8;
constexpr double kMiddle = 0.001;               // m
constexpr double kPlaceSigma = 0.03;            // m
constexpr double kLeastPlace = 0.005;           // m
constexpr double kMostPlace = 3 * kPlaceSigma;  // m: more is another frame

}  // namespace

WheelPrior::WheelPrior(const Eigen::Vector2d& c)
    : sigmas_(WheelErrors::of(0.03, 0.02, 0.01, 0.026, kPlaceSigma, kPlaceSigma)),
      to_camera_(Matrix::Identity()) {
  to_camera_.block<2, 1>(kPlace, kDirection) = Eigen::Vector2d(c.y(), -c.x());
  if (c.norm() < kMiddle) fix_place();
}

Matrix WheelPrior::information() const {
  const Vector information = sigmas_.cwiseAbs2().cwiseInverse();
  return to_camera_.transpose() * information.asDiagonal() * to_camera_;
}

int WheelPrior::free() const { return static_cast<int>((sigmas_.array() > kNone).count()); }
void WheelPrior::fix_direction() { sigmas_(kDirection) = kNone; }
void WheelPrior::fix_place() { sigmas_.segment<2>(kPlace).setConstant(kNone); }
bool WheelPrior::is_free(int error) const { return sigmas_(error) > kNone; }
bool WheelPrior::mounting_is_free() const { return is_free(kDirection) || is_free(kPlace); }

std::optional<WheelErrors> WheelPrior::settle(
    const std::function<std::optional<WheelErrors>()>& estimate, double sigmas) {
  auto errors = estimate();
  const auto settle_place = [&] {
    if (!errors || !is_free(kPlace) || place_observed(*errors)) return;
    fix_place();
    errors = estimate();
  };
  settle_place();
  if (errors && is_free(kDirection) && !direction_observed(*errors, sigmas)) {
    fix_direction();
    errors = estimate();
  }
  settle_place();
  return errors;
}

bool WheelPrior::direction_observed(const WheelErrors& e, double sigmas) {
  return std::abs(e.value(kDirection)) >= sigmas * std::sqrt(e.covariance(kDirection, kDirection));
}

bool WheelPrior::place_observed(const WheelErrors& e) const {
  const Eigen::Vector2d off = (to_camera_ * e.value).segment<2>(kPlace);
  const Matrix all = to_camera_ * e.covariance * to_camera_.transpose();
  const Eigen::Matrix2d C = all.block<2, 2>(kPlace, kPlace);
  return off.norm() >= kLeastPlace && off.norm() <= kMostPlace &&
         off.dot(C.inverse() * off) >= kPlaceObserved;
}

MountingCorrection WheelPrior::correction(const Vector& errors) const {
  const Vector of_camera = to_camera_ * errors;
  MountingCorrection result;
  if (is_free(kDirection)) result.rotation_body.z() = -errors(kDirection);
  if (is_free(kPlace)) result.translation_body.head<2>() = of_camera.segment<2>(kPlace);
  return result;
}

}  // namespace lamina
