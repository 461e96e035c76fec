// Maps made only to learn what is wrong with the wheels.
#include <lamina/apps/wheel_calibration.hpp>

#include <algorithm>

#include <lamina/apps/mounting_calibration.hpp>
#include <lamina/backend/mapper.hpp>
#include <lamina/backend/refiner.hpp>

namespace lamina::apps {
namespace {

// Sigmas of scale (1), drift (rad/m) and turn scale (1) among robots' wheels, and of the direction
// (rad) among mountings.
const Eigen::Vector4d kUsual(0.03, 0.02, 0.01, 0.026);
constexpr int kMostPasses = 3;

bool by_wheels(const Step& step) { return step.motion_known && !step.tracking_lost; }

SE3 corrected_motion(const Step& step, const Eigen::Vector4d& errors) {
  return by_wheels(step) ? corrected(step.motion.T_from_to, errors) : step.motion.T_from_to;
}

Graph refined_graph(const std::vector<Step>& steps, const Eigen::Vector4d& errors,
                    const MapperOptions& options, const std::function<bool()>& ended) {
  Mapper mapper(options);
  for (std::size_t i = 0; i < steps.size() && !ended(); ++i) {
    // The first motion is the first pose.
    const SE3 T = i == 0 ? steps[i].motion.T_from_to : corrected_motion(steps[i], errors);
    mapper.add(steps[i].observations, T, steps[i].motion.covariance);
  }
  RefineOptions quick;
  quick.thorough = false;
  mapper.refine(quick, [&](const RefineProgress&) { return !ended(); });
  return mapper.graph();
}

}  // namespace

bool wheels_and_images_alone(const std::vector<Step>& steps) {
  return std::none_of(steps.begin(), steps.end(),
                      [](const Step& step) { return step.scan.has_value(); });
}

std::optional<WheelErrors> calibrate_wheels(std::vector<Step>& steps, const MapperOptions& options,
                                            const std::function<bool()>& ended) {
  double by_chance = 4;  // mean of chi-squared where there are no errors
  constexpr double kStays = 1;
  constexpr double kTold = 3;  // sigmas: below, how cameras are turned stays as calibrated
  Eigen::Vector4d usual = kUsual;
  WheelErrors all;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const Graph graph = refined_graph(steps, all.value, options, ended);
    if (ended()) return std::nullopt;
    auto more = estimate_wheel_errors(graph, usual, all.value);
    if (pass == 0 && more && std::abs(more->value(3)) < kTold * std::sqrt(more->covariance(3, 3))) {
      usual(3) = 1e-5;
      by_chance = 3;
      more = estimate_wheel_errors(graph, usual, all.value);
    }
    if (!more || (pass == 0 && more->significance() < by_chance)) return std::nullopt;
    all = {all.value + more->value, more->covariance};
    if (more->significance() < kStays) break;
  }
  // The direction of travel is told in the frame in which cameras are said to sit: they turn back.
  const MountingCorrection turned{{0, 0, -all.value(3)}, Eigen::Vector3d::Zero()};
  Eigen::Vector4d of_wheels = all.value;
  of_wheels(3) = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i > 0) steps[i].motion.T_from_to = corrected_motion(steps[i], of_wheels);
    remount(steps[i], turned);
  }
  return all;
}

}  // namespace lamina::apps
