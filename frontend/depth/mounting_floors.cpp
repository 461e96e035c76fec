// The floors that views show, where a mounting has them or near it.
#include <algorithm>
#include <cmath>

#include <lamina/frontend/depth/mounting_check.hpp>

namespace lamina {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// 1-sigma, by the median distance from the median.
double scatter(std::vector<double> values) {
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  return 1.4826 * median(std::move(values));
}

double middle_of(const std::vector<Leveling>& all, double Leveling::*what) {
  std::vector<double> values;
  for (const Leveling& one : all) values.push_back(one.*what);
  return median(std::move(values));
}

}  // namespace

std::vector<Leveling> MountingCheck::floors_of(const CameraCorrection& c) const {
  constexpr double kFound = 0.2;  // rad and share: a floor, tilted as bodies are
  const SE3 T = c.T_body_camera.value_or(T_body_camera_);
  std::vector<Leveling> floors;
  for (const MountingView& view : views_) {
    const MountingView::Seen* floor = nullptr;
    for (const MountingView::Seen& seen : view.planes) {
      const Plane plane = corrected(seen.plane_camera, c);
      const double off = std::abs(-plane.rho() / T.translation().z() - 1);
      const double level = (T.so3() * plane.normal()).z();
      const bool lies = level > std::cos(kFound) && off < kFound;
      if (lies && (!floor || seen.share > floor->share)) floor = &seen;
    }
    if (floor) floors.push_back(leveling_of(T, corrected(floor->plane_camera, c)));
  }
  return floors;
}

void MountingCheck::add_scatter(MountingVerdict& verdict) const {
  const std::vector<Leveling> floors = floors_of(verdict.best.correction);
  if (!height_stated_ || floors.size() < options_.least_images) return;
  const SE3 T = verdict.best.correction.T_body_camera.value_or(T_body_camera_);
  std::vector<double> heights, rolls, pitches;
  for (const Leveling& l : floors) {
    heights.push_back(l.height / T.translation().z());
    rolls.push_back(l.roll);
    pitches.push_back(l.pitch);
  }
  verdict.height_scatter = scatter(heights);
  verdict.tilt_scatter = std::max(scatter(rolls), scatter(pitches));
}

SE3 MountingCheck::levelled(const CameraCorrection& c) const {
  const SE3 T = c.T_body_camera.value_or(T_body_camera_);
  const std::vector<Leveling> floors = floors_of(c);
  if (floors.empty()) return T;
  return apply(Leveling{middle_of(floors, &Leveling::roll), middle_of(floors, &Leveling::pitch),
                        middle_of(floors, &Leveling::height)},
               T);
}

}  // namespace lamina
