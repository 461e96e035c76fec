// A camera said to be the body's own frame, which looks ahead: is its optical rotation missing?
#pragma once

#include <cstdint>

#include <lamina/frontend/depth/floor_result.hpp>

namespace lamina {

/// Images of a camera whose T_body_camera turns nothing. By that it looks along the body's z,
/// straight up, and can see no floor. Counts images that show a floor as it is stated, and those
/// that show a plane where a floor would be if the body's x were the camera's z, body z its -y.
class OpticalWatch {
 public:
  /// Only where `T_body_camera`, as stated, does not turn.
  void add(const FloorResult& floor, const SE3& T_body_camera);
  std::int64_t images() const { return images_; }
  std::int64_t floors_as_stated() const { return as_stated_; }
  std::int64_t floors_if_ahead() const { return if_ahead_; }
  /// m, of the camera over these planes, their mean; 0 where there was none.
  double height_if_ahead() const;
  /// Ten images or more, a third of them show floor only if the camera looks ahead.
  bool rotation_missing() const;

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, OpticalWatch& v) {
    a(v.images_, v.as_stated_, v.if_ahead_, v.height_sum_);
  }

 private:
  std::int64_t images_ = 0, as_stated_ = 0, if_ahead_ = 0;
  double height_sum_ = 0;
};

}  // namespace lamina
