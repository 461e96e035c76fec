// Poses between the two ends of a hole.
#include <lamina/pipeline/hole_steps.hpp>

#include <algorithm>

#include <lamina/frontend/motion/motion_covariances.hpp>

namespace lamina {
namespace {

// Steps from `begin` on, up to `end`, which stays where it is.
void lay(std::vector<Step>& steps, std::size_t begin, std::size_t end) {
  const Step& before = steps[begin - 1];
  const SE3 T_before = before.T_start_body;
  const Vector6d way = (T_before.inverse() * steps[end].T_start_body).log();
  const Timestamp from = before.observations.stamp;
  const double all = steps[end].observations.stamp - from;
  Timestamp last = from;
  for (std::size_t k = begin; k <= end; ++k) {
    Step& step = steps[k];
    const Timestamp stamp = step.observations.stamp;
    if (k < end) step.T_start_body = T_before * SE3::exp((stamp - from) / all * way);
    step.motion = {steps[k - 1].T_start_body.inverse() * step.T_start_body,
                   still_covariance(stamp - last)};
    step.motion_known = true;
    step.tracking_lost = step.by_image = step.open_direction = false;
    last = stamp;
  }
}

}  // namespace

std::int64_t lay_across_holes(std::vector<Step>& steps) {
  std::int64_t laid = 0;
  for (std::size_t end = 0; end < steps.size(); ++end) {
    const auto count = static_cast<std::size_t>(steps[end].across_hole);
    if (count == 0 || count >= end) continue;
    const std::size_t begin = end - count;
    const bool lost = std::any_of(steps.begin() + static_cast<std::ptrdiff_t>(begin),
                                  steps.begin() + static_cast<std::ptrdiff_t>(end),
                                  [](const Step& step) { return step.tracking_lost; });
    if (!lost || !(steps[begin - 1].observations.stamp < steps[end].observations.stamp)) continue;
    lay(steps, begin, end);
    laid += static_cast<std::int64_t>(count);
  }
  return laid;
}

}  // namespace lamina
