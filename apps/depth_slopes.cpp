// Maps made only to learn what is wrong with a depth camera.
#include <lamina/apps/depth_slopes.hpp>

#include <spdlog/spdlog.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <variant>

#include <lamina/apps/mounting_calibration.hpp>
#include <lamina/apps/wheel_calibration.hpp>
#include <lamina/apps/wheel_prior.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {
namespace {

using Vector = DepthErrors::Vector;
using Matrix = DepthErrors::Matrix;
constexpr int kMostPasses = 3;
constexpr double kHeld = 1e-6;  // a sigma: as it is
// 1-sigma of what is usual: roll and pitch (rad) and height (m), of floors told well by each image;
// slopes and constant (1/m): a tenth of a pixel of disparity and more; focal length: sensors'
// nominal ones are off by some percent.
constexpr double kLevel = 0.01, kHeight = 0.02, kSlope = 0.01, kConstant = 0.005, kFocal = 0.03;
constexpr int kSlopes = DepthErrors::kWheels + DepthErrors::kLevel, kOffset = kSlopes + 2,
              kLength = kSlopes + 3;

// `camera`: 1-sigma of slopes and constant (1/m) and of the focal length.
Matrix prior_of(const Eigen::Vector2d& camera_place, const Eigen::Vector4d& camera) {
  Matrix information = Matrix::Zero();
  information.topLeftCorner<WheelErrors::kCount, WheelErrors::kCount>() =
      WheelPrior(camera_place).information();
  Eigen::Matrix<double, 7, 1> sigmas;
  sigmas << kLevel, kLevel, kHeight, camera.cwiseMax(kHeld);
  information.diagonal().tail<7>() = sigmas.cwiseAbs2().cwiseInverse();
  return information;
}

std::vector<Step> less(const DepthErrors& errors, const std::vector<Step>& steps) {
  const DepthCameraError wrong = errors.camera();
  const Eigen::Vector3d level = errors.level();
  const MountingCorrection moved{{level.x(), level.y(), 0}, {0, 0, level.z()}};
  std::vector<Step> corrected = steps;
  for (Step& step : corrected) {
    remount(step, moved);
    for (PlaneObservation& plane : step.observations.planes) {
      plane.plane_sensor = wrong.corrected(plane.plane_sensor);
      plane.moments_sensor = wrong.corrected(plane.moments_sensor);
      for (Eigen::Vector3d& corner : plane.outline_sensor) corner = wrong.corrected(corner);
    }
  }
  return corrected;
}

// 1-sigma of slopes and constant (1/m) and of the focal length: wide where the estimate `loose`
// says that they stand out of zero, else as usual.
Eigen::Vector4d expected(const DepthErrors& loose, const Eigen::Vector3d& usual) {
  constexpr double kToldSlopes = 25;   // chi-squared of two
  constexpr double kToldConstant = 4;  // sigmas
  constexpr double kToldFocal = 5;     // likewise
  Eigen::Vector4d sigmas;
  sigmas << usual, 0;
  const Eigen::Vector2d slopes = loose.value.segment<2>(kSlopes);
  const Eigen::Matrix2d covariance = loose.covariance.block<2, 2>(kSlopes, kSlopes);
  if (slopes.dot(covariance.inverse() * slopes) > kToldSlopes) sigmas.head<2>().setConstant(kSlope);
  const auto in_sigmas = [&](int error) {
    return std::abs(loose.value(error)) / std::sqrt(loose.covariance(error, error));
  };
  if (in_sigmas(kOffset) > kToldConstant) sigmas.z() = kConstant;
  if (in_sigmas(kLength) > kToldFocal) sigmas.w() = kFocal;
  return sigmas;
}

}  // namespace

std::optional<DepthErrors> depth_errors_of(const std::vector<Step>& steps,
                                           const MapperOptions& options,
                                           const Eigen::Vector3d& usual,
                                           const std::function<bool()>& ended) {
  constexpr double kStays = 1;  // chi-squared of what a pass adds
  if (steps.empty()) return std::nullopt;
  const Eigen::Vector2d place = camera_place(steps);
  DepthErrors all;
  Eigen::Vector4d camera(kSlope, kSlope, kConstant, kFocal);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const std::vector<Step> now = less(all, steps);
    const Graph graph = quick_map(now, all.wheels(), options, ended);
    if (ended()) return std::nullopt;
    const SE3& T_body_camera = now.front().observations.T_body_sensor;
    const auto estimate = [&] {
      return estimate_depth_errors(graph, T_body_camera, prior_of(place, camera), all.value);
    };
    auto more = estimate();
    if (pass == 0 && more) {
      camera = expected(*more, usual);
      more = estimate();
    }
    if (!more) return std::nullopt;
    const double chi2 = more->value.dot(more->covariance.ldlt().solve(more->value));
    all = {all.value + more->value, more->covariance};
    if (chi2 < kStays) break;
  }
  return all;
}

std::optional<DepthDistortion> find_depth_slopes(Recording& recording, const Settings& settings,
                                                 const DepthDistortion& distortion,
                                                 const std::optional<TiltedStart>& start,
                                                 io::Metrics& metrics,
                                                 const std::function<bool()>& ended) {
  constexpr std::size_t kMost = 600, kLeast = 30;  // images
  constexpr double kEvery = 0.15;                  // s
  // 1-sigma of what is left of slopes (edge to edge) and constant, over the rms of the bend. Planes
  // tell a bend but for these; right angles and the floor tell part of them.
  constexpr double kSlopeOfBend = 1, kConstantOfBend = 0.2;
  if (!recording.calibration().odometry.planar) return std::nullopt;
  FrontEnd front_end(settings, recording.calibration());
  front_end.correct_depth(distortion);
  if (start) front_end.begin_tilted(*start);
  io::Metrics aside;
  std::vector<Step> steps;
  std::optional<DepthFrame> first;
  std::optional<Timestamp> last;
  try {
    while (!ended() && steps.size() < kMost) {
      const auto measurement = recording.next();
      if (!measurement) break;
      if (const auto* image = std::get_if<DepthFrame>(&*measurement)) {
        if (last && image->stamp - *last < kEvery) continue;
        last = image->stamp;
        if (!first) first = *image;
      } else if (!std::holds_alternative<Odometry>(*measurement)) {
        continue;
      }
      auto step = front_end.process(*measurement, aside);
      if (!step) continue;
      step->obstacles.reset();
      steps.push_back(std::move(*step));
      if (steps.size() == kLeast && !front_end.met_wheels()) return std::nullopt;
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
  if (ended() || steps.size() < kLeast || !front_end.met_wheels()) return std::nullopt;
  const CameraModel& camera = first->camera.camera;
  const double fb = first->camera.noise.focal_baseline;
  const Eigen::Vector2d px(fb * first->width() / camera.fx, fb * first->height() / camera.fy);
  const double bend = distortion.rms();
  Eigen::Vector3d usual;
  usual << kSlopeOfBend * bend * px.cwiseInverse(), kConstantOfBend * bend / fb;
  const auto found = depth_errors_of(steps, settings.mapper, usual, ended);
  if (!found) return std::nullopt;
  const Eigen::Vector2d slopes = found->value.segment<2>(kSlopes);
  const double across = px.x() * slopes.x(), down = px.y() * slopes.y();
  const double focal = found->value(kLength);
  const bool slope = slopes.norm() > 10 * kHeld, length = std::abs(focal) > 10 * kHeld;
  if (!slope && !length) return std::nullopt;
  if (slope) {
    spdlog::info(
        "depth images slope by {:+.2f} px of disparity across and {:+.2f} px down: taken out",
        across, down);
    metrics.counts["depth_slope_across_px"] = across;
    metrics.counts["depth_slope_down_px"] = down;
  }
  if (length) {
    const double is = camera.fx / (1 + focal);
    spdlog::info(
        "the depth camera's focal length is {:.1f} +- {:.1f} px, stated are {:.1f}: corrected", is,
        is * std::sqrt(found->covariance(kLength, kLength)), camera.fx);
    metrics.counts["depth_focal_px"] = is;
  }
  DepthDistortion with_slopes = distortion;
  with_slopes.add(found->camera(), *first);
  return with_slopes;
}

}  // namespace lamina::apps
