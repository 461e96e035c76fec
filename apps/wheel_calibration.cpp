// Maps made only to learn what is wrong with the wheels.
#include <lamina/apps/wheel_calibration.hpp>

#include <algorithm>

#include <lamina/backend/mapper.hpp>
#include <lamina/backend/refiner.hpp>

namespace lamina::apps {
namespace {

// Sigmas of scale (1), drift (rad/m) and turn scale (1) among robots' wheels.
const Eigen::Vector3d kUsual(0.03, 0.02, 0.01);
constexpr int kMostPasses = 3;

bool by_wheels(const Step& step) { return step.motion_known && !step.tracking_lost; }

SE3 corrected_motion(const Step& step, const Eigen::Vector3d& errors) {
  return by_wheels(step) ? corrected(step.motion.T_from_to, errors) : step.motion.T_from_to;
}

Graph refined_graph(const std::vector<Step>& steps, const Eigen::Vector3d& errors,
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
  constexpr double kChance = 3;  // mean of chi-squared where there are no errors
  constexpr double kStays = 1;
  WheelErrors all;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const Graph graph = refined_graph(steps, all.value, options, ended);
    if (ended()) return std::nullopt;
    const auto more = estimate_wheel_errors(graph, kUsual, all.value);
    if (!more || (pass == 0 && more->significance() < kChance)) return std::nullopt;
    all = {all.value + more->value, more->covariance};
    if (more->significance() < kStays) break;
  }
  for (std::size_t i = 1; i < steps.size(); ++i) {
    steps[i].motion.T_from_to = corrected_motion(steps[i], all.value);
  }
  return all;
}

}  // namespace lamina::apps
