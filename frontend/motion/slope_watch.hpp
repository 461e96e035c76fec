// When a camera saw the ground change its slope.
#pragma once

#include <cstdint>
#include <optional>

#include <lamina/frontend/depth/floor_result.hpp>

namespace lamina {

/// Wheels and scans take the ground for one plane. Where a camera sees it change its slope, the
/// body may tilt over the next seconds of driving: that is kept in mind, and while the body stands
/// before a ramp no time passes.
class SlopeWatch {
 public:
  void add(const FloorResult& floor);
  /// Up to `stamp` the body stood for `dt` (s).
  void stood(Timestamp stamp, double dt);
  /// A change of slope was seen in the last seconds of driving.
  bool of_late(Timestamp stamp) const;
  /// Likewise, both slopes in one image: no knocked camera shows that.
  bool two_of_late(Timestamp stamp) const;
  /// Images in which the ground changes its slope.
  std::int64_t images() const { return images_; }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, SlopeWatch& v) {
    auto& [last, last_two, images] = v;
    a(last, last_two, images);
  }

 private:
  std::optional<Timestamp> last_, last_two_;
  std::int64_t images_ = 0;
};

}  // namespace lamina
