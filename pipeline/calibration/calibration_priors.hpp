// What is usual of wheels' errors and cameras' mountings, and what stands out from it.
#pragma once

#include <functional>
#include <optional>

#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/frontend/segments/mounting_correction.hpp>

namespace lamina {

/// Prior of WheelErrors of a robot with cameras. Zero to 3 % of scale, 1.1 deg/m of drift and 1 %
/// of turns; cameras' heading to 1.5 degrees and their place to 3 cm, each by itself. The errors'
/// `place` is that of the frame in which cameras are said to sit: with a camera said to be at c, J
/// a quarter turn, it is itself off by
///   camera = place - direction J c.
class WheelPrior {
 public:
  /// `camera_place`: c (m, body x and y). Of cameras said to sit in the very middle (to
  /// 1 mm) nobody said where they sit: their place is fixed.
  explicit WheelPrior(const Eigen::Vector2d& camera_place);

  WheelErrors::Matrix information() const;
  /// Errors that are free: mean of WheelErrors::significance where there are none.
  int free() const;
  void fix_direction();
  void fix_place();
  bool mounting_is_free() const;  ///< direction, place or both
  /// What `estimate` makes of this prior, once direction (from so many sigmas) and place are fixed
  /// where they do not stand out. Without a direction the place may be another: it is asked twice.
  std::optional<WheelErrors> settle(const std::function<std::optional<WheelErrors>()>& estimate,
                                    double sigmas);
  /// Whether the direction stands out by so many sigmas.
  static bool direction_observed(const WheelErrors& errors, double sigmas);
  /// Whether the cameras' place stands out (chi-squared of 2 dof, one in a thousand), by no less
  /// than 5 mm (wheels turn about no finer a point) and no more than 6 cm (that is no error but a
  /// mounting nobody stated).
  bool place_observed(const WheelErrors& errors) const;
  /// What must be done to a camera's mounting.
  MountingCorrection correction(const WheelErrors::Vector& errors) const;

 private:
  bool is_free(int error) const;
  WheelErrors::Vector sigmas_;
  WheelErrors::Matrix to_camera_;  ///< from errors to those of the camera itself
};

}  // namespace lamina
