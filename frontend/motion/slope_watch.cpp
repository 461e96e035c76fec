// Changes of slope in images, kept in mind for seconds of driving.
#include <lamina/frontend/motion/slope_watch.hpp>

#include <algorithm>

namespace lamina {
namespace {

constexpr double kSlopeTime = 5;  // s of driving that a change of slope is kept in mind

bool within(const std::optional<Timestamp>& seen, Timestamp stamp) {
  return seen && stamp - *seen < kSlopeTime;
}

}  // namespace

void SlopeWatch::add(const FloorResult& floor) {
  constexpr double kLeast = 0.026, kMost = 0.35, kShare = 0.02;  // rad; of the image's pixels
  const double all = static_cast<double>(floor.pixel_labels.size());
  const SE3 off = floor.T_body_camera * floor.mounting.T_body_camera.inverse();
  const bool tilted =
      floor.status == FloorStatus::kFound && off.so3().log().head<2>().norm() > kLeast;
  bool both = false;
  for (const ExtractedPlane& p : floor.planes) {
    const bool ground = p.kind == PlaneKind::kSubDominant && p.slope > kLeast && p.slope < kMost;
    both = both || (ground && static_cast<double>(p.pixels) > kShare * all);
  }
  if (both) last_two_ = floor.stamp;
  if (!both && !tilted) return;
  ++images_;
  last_ = floor.stamp;
}

void SlopeWatch::stood(Timestamp stamp, double dt) {
  for (std::optional<Timestamp>* seen : {&last_, &last_two_})
    if (*seen) *seen = std::min(stamp, **seen + dt);
}

bool SlopeWatch::of_late(Timestamp stamp) const { return within(last_, stamp); }

bool SlopeWatch::two_of_late(Timestamp stamp) const { return within(last_two_, stamp); }

}  // namespace lamina
