// Whether a floor that is off may come from a knocked camera, by what the body did meanwhile.
#pragma once

#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// A body drives along a carpet's edge, a sill, a cable with its wheels on one side: for a metre or
/// two its floor looks as from a knocked camera. A camera that was knocked stays so for longer, and
/// may be knocked while the body stands, which does not tilt by itself.
class KnockWatch {
 public:
  /// `off`: the last image's floor was set aside (MountingTracker). `T_start_body`: where the body
  /// was then. Whether a knock may be believed: floors are off since the body stood, or for 3 m.
  bool may_be(bool off, const SE3& T_start_body);

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, KnockWatch& v) {
    a(v.T_start_last_, v.off_, v.stood_);
  }

 private:
  SE3 T_start_last_;  // where the floor was last as expected
  bool off_ = false, stood_ = true;
};

}  // namespace lamina
