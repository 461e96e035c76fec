// Counting planes below a camera that looks ahead.
#include <lamina/frontend/depth/optical_watch.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr double kStill = 1e-6;   // rad
constexpr double kCosine = 0.64;  // of 50 deg: how far down or up it may look
constexpr double kArea = 0.2;     // m^2
constexpr double kHeight = 0.1;   // m

}  // namespace

void OpticalWatch::add(const FloorResult& floor, const SE3& T_body_camera) {
  if (T_body_camera.so3().log().norm() > kStill) return;
  ++images_;
  as_stated_ += floor.status == FloorStatus::kFound;
  // planes are largest first
  const auto below =
      std::find_if(floor.planes.begin(), floor.planes.end(), [](const ExtractedPlane& p) {
        return -p.plane_camera.normal().y() > kCosine && p.area > kArea &&
               std::abs(p.plane_camera.rho()) > kHeight;
      });
  if (below == floor.planes.end()) return;
  ++if_ahead_;
  height_sum_ += std::abs(below->plane_camera.rho());
}

double OpticalWatch::height_if_ahead() const {
  return if_ahead_ > 0 ? height_sum_ / static_cast<double>(if_ahead_) : 0;
}

bool OpticalWatch::rotation_missing() const {
  constexpr std::int64_t kImages = 10;
  return images_ >= kImages && 3 * if_ahead_ >= images_ && 3 * as_stated_ < if_ahead_;
}

}  // namespace lamina
