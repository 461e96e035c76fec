// Maps made only to learn what is wrong with the wheels.
#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>

#include <algorithm>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/pipeline/calibration/block_maps.hpp>
#include <lamina/pipeline/calibration/calibration_priors.hpp>
#include <lamina/pipeline/calibration/extrinsics.hpp>

namespace lamina {
namespace {

using Vector = WheelErrors::Vector;
constexpr int kMostPasses = 3;

SE3 corrected_motion(const Step& step, const Vector& errors) {
  return observed_by_wheels(step) ? corrected(step.motion.T_from_to, errors)
                                  : step.motion.T_from_to;
}

}  // namespace

Eigen::Vector2d camera_place(const std::vector<Step>& steps) {
  for (const Step& step : steps) {
    const SE3& T = step.observations.T_body_sensor;
    if (!T.translation().isZero(0)) return T.translation().head<2>();
  }
  return Eigen::Vector2d::Zero();
}

bool observed_by_wheels(const Step& step) {
  return step.motion_known && !step.tracking_lost && !step.by_image;
}

bool observed_by_sensor(const Step& step) {
  if (!step.motion_known || step.tracking_lost) return false;
  return step.by_image ||
         (step.scan_motion && step.scan_motion->status == ScanMotion::Status::kTracked);
}

bool one_kind_of_camera(const std::vector<Step>& steps) {
  return std::all_of(steps.begin(), steps.end(), [&steps](const Step& step) {
    return step.observations.sensor == steps.front().observations.sensor;
  });
}

bool wheels_and_images_alone(const std::vector<Step>& steps) {
  return std::none_of(steps.begin(), steps.end(),
                      [](const Step& step) { return step.scan.has_value(); });
}

Graph quick_map(const std::vector<Step>& steps, const Vector& errors, const MapperOptions& options,
                const std::function<bool()>& ended) {
  Mapper mapper(options);
  for (std::size_t i = 0; i < steps.size() && !ended(); ++i) {
    // The first motion is the first pose.
    const SE3 T = i == 0 ? steps[i].motion.T_from_to : corrected_motion(steps[i], errors);
    mapper.add(steps[i].observations, T, steps[i].motion.covariance, observed_by_sensor(steps[i]));
  }
  RefineOptions quick;
  quick.thorough = false;
  mapper.refine(quick, [&](const RefineProgress&) { return !ended(); });
  return mapper.graph();
}

namespace {

// Of the errors that `prior` leaves free, against none.
Adoption adoption_of(const std::vector<Step>& steps, const MapperOptions& options,
                     const WheelPrior& prior, const std::function<bool()>& ended) {
  constexpr double kHeld = 1e-5;  // a sigma
  using Matrix = WheelErrors::Matrix;
  const Matrix asked = prior.information();
  const Matrix held = Matrix::Identity() / (kHeld * kHeld);
  const auto blocks = evidence_by_blocks(
      steps, options,
      [&asked](const Graph& graph) -> std::optional<QuadraticBlock> {
        const auto one = estimate_wheel_errors(graph, asked);
        if (!one) return std::nullopt;
        return without_prior(one->value, one->covariance, asked);
      },
      ended);
  return judge(blocks, held, asked).adoption;
}

}  // namespace

std::optional<WheelCalibration> calibrate_wheels(const std::vector<Step>& steps,
                                                 const MapperOptions& options, bool remounting,
                                                 const std::function<bool()>& ended) {
  constexpr double kStays = 1;     // chi-squared of what a pass adds
  constexpr double kObserved = 3;  // sigmas: below, how cameras are turned stays as calibrated
  WheelPrior prior(camera_place(steps));
  const bool fixed = !remounting || !one_kind_of_camera(steps);
  if (fixed) prior.fix_place();
  if (fixed) prior.fix_direction();
  WheelErrors all;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const Graph graph = quick_map(steps, all.value, options, ended);
    if (ended()) return std::nullopt;
    const auto estimate = [&] {
      return estimate_wheel_errors(graph, prior.information(), all.value);
    };
    const auto more = pass == 0 ? prior.settle(estimate, kObserved) : estimate();
    if (!more) return std::nullopt;
    all = {all.value + more->value, more->covariance};
    if (more->significance() < kStays) break;
  }
  return WheelCalibration{all, prior.correction(all.value),
                          adoption_of(steps, options, prior, ended)};
}

void apply_correction(std::vector<Step>& steps, const WheelCalibration& found) {
  Vector of_wheels = found.errors.value;
  of_wheels.tail<3>().setZero();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i > 0) steps[i].motion.T_from_to = corrected_motion(steps[i], of_wheels);
    apply_correction(steps[i], found.cameras);
  }
}

}  // namespace lamina
