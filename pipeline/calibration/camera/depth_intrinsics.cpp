// Maps made only to learn what is wrong with a depth camera.
#include <lamina/pipeline/calibration/camera/depth_intrinsics.hpp>

#include <spdlog/spdlog.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <variant>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/calibration/block_maps.hpp>
#include <lamina/pipeline/calibration/calibration_priors.hpp>
#include <lamina/pipeline/calibration/calibration_report.hpp>
#include <lamina/pipeline/calibration/extrinsics.hpp>
#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>

namespace lamina {
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
    apply_correction(step, moved);
    for (PlaneObservation& plane : step.observations.planes) {
      plane.plane_sensor = wrong.corrected(plane.plane_sensor);
      plane.moments_sensor = wrong.corrected(plane.moments_sensor);
      for (Eigen::Vector3d& corner : plane.outline_sensor) corner = wrong.corrected(corner);
    }
  }
  return corrected;
}

// 1-sigma of slopes and constant (1/m) and of the focal length, by what blocks left out say.
Eigen::Vector4d adopted(const std::vector<QuadraticBlock>& blocks, const Eigen::Vector2d& place,
                        const Eigen::Vector3d& usual, FoundDepthErrors& found) {
  const Eigen::Vector4d held = Eigen::Vector4d::Zero();
  const auto judged = [&](const Eigen::Vector4d& stated, const Eigen::Vector4d& asked) {
    return judge(blocks, prior_of(place, stated), prior_of(place, asked));
  };
  Eigen::Vector4d camera = held, slopes = held;
  slopes << kSlope, kSlope, kConstant, 0;
  Eigen::Vector4d focal(0, 0, 0, kFocal);
  JudgedBlocks tilted = judged(held, slopes);
  if (!tilted.adoption.adopted && !usual.isZero()) {
    slopes << usual, 0;
    tilted = judged(held, slopes);
  }
  found.slopes = tilted.adoption;
  if (found.slopes.adopted) camera = slopes;
  const JudgedBlocks length = judged(camera, camera + focal);
  found.focal = length.adoption;
  if (length.value.size() == 0) return camera;
  found.alone << tilted.value.segment<2>(kSlopes), length.value(kLength);
  found.sigma << tilted.covariance.diagonal().segment<2>(kSlopes).cwiseSqrt(),
      std::sqrt(length.covariance(kLength, kLength));
  if (found.focal.adopted && std::abs(found.alone.z()) <= kFocalBound) camera += focal;
  return camera;
}

// Up to 600 of a recording's images as steps; empty where no wheels told their motions.
std::vector<Step> steps_of(Recording& recording, FrontEnd& front_end,
                           std::optional<DepthFrame>& first, const std::function<bool()>& ended) {
  constexpr std::size_t kMost = 600, kLeast = 30;  // images
  constexpr double kEvery = 0.15;                  // s
  Diagnostics aside;
  std::vector<Step> steps;
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
      if (steps.size() == kLeast && !front_end.motion().wheels().met_on_floor()) return {};
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
  if (ended() || steps.size() < kLeast || !front_end.motion().wheels().met_on_floor()) return {};
  return steps;
}

// `px`: pixels of disparity a slope of one makes across and down. Leaves in `found` what counts.
void tell(FoundDepthErrors& found, const CameraModel& camera, const Eigen::Vector2d& px,
          Diagnostics& metrics) {
  const double fx = camera.fx;
  double& focal = found.value(kLength);
  const double shown = focal == 0 || !found.focal.adopted ? found.alone.z() : focal;
  const Estimate length{"depth_camera.fx_px", fx,          fx / (1 + shown),
                        fx * found.sigma.z(), found.focal, kFocalBound * fx};
  if (report(
          length, metrics, "focal_length",
          "not corrected: another image size, a depth scale or a body that pitches is likelier")) {
    metrics.counts.depth_focal_px = fx / (1 + focal);
  } else {
    focal = 0;
  }
  const char* const names[] = {"across", "down"};
  for (int k = 0; k < 2; ++k) {
    const double slope = found.slopes.adopted ? found.value(kSlopes + k) : found.alone(k);
    const Estimate one{std::string("depth_camera.slope_") + names[k] + "_px", 0, px(k) * slope,
                       px(k) * found.sigma(k), found.slopes};
    if (report(one, metrics)) metrics.counts.depth_slope_px[k] = px(k) * slope;
  }
}

}  // namespace

std::optional<FoundDepthErrors> depth_errors_of(const std::vector<Step>& steps,
                                                const MapperOptions& options,
                                                const Eigen::Vector3d& usual,
                                                const std::function<bool()>& ended) {
  constexpr double kStays = 1;  // chi-squared of what a pass adds
  if (steps.empty()) return std::nullopt;
  const Eigen::Vector2d place = camera_place(steps);
  FoundDepthErrors all;
  const SE3 T_body_stated = steps.front().observations.T_body_sensor;
  const Matrix wide = prior_of(place, {kSlope, kSlope, kConstant, kFocal});
  const auto blocks = evidence_by_blocks(
      steps, options,
      [&](const Graph& graph) -> std::optional<QuadraticBlock> {
        const auto one = estimate_depth_errors(graph, T_body_stated, wide, Vector::Zero());
        if (!one) return std::nullopt;
        return without_prior(one->value, one->covariance, wide);
      },
      ended);
  const Eigen::Vector4d camera = adopted(blocks, place, usual, all);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const std::vector<Step> now = less(all, steps);
    const Graph graph = quick_map(now, all.wheels(), options, ended);
    if (ended()) return std::nullopt;
    const SE3& T_body_camera = now.front().observations.T_body_sensor;
    const auto more =
        estimate_depth_errors(graph, T_body_camera, prior_of(place, camera), all.value);
    if (!more) return std::nullopt;
    const double chi2 = more->value.dot(more->covariance.ldlt().solve(more->value));
    all.value += more->value;
    all.covariance = more->covariance;
    if (chi2 < kStays) break;
  }
  return all;
}

std::optional<DepthDistortion> find_depth_slopes(Recording& recording,
                                                 const CalibrationOptions& settings,
                                                 const DepthDistortion& distortion,
                                                 const std::optional<TiltedStart>& start,
                                                 Diagnostics& metrics,
                                                 const std::function<bool()>& ended) {
  // 1-sigma of what is left of slopes (edge to edge) and constant, over the rms of the bend. Planes
  // tell a bend but for these; right angles and the floor tell part of them.
  constexpr double kSlopeOfBend = 1, kConstantOfBend = 0.2;
  if (!recording.calibration().odometry.planar) return std::nullopt;
  FrontEnd front_end(settings, recording.calibration());
  front_end.correct_depth(distortion);
  if (start) front_end.begin_tilted(*start);
  std::optional<DepthFrame> first;
  const std::vector<Step> steps = steps_of(recording, front_end, first, ended);
  if (steps.empty()) return std::nullopt;
  const CameraModel& camera = first->camera.camera;
  const double fb = first->camera.noise.focal_baseline;
  const Eigen::Vector2d px(fb * first->width() / camera.fx, fb * first->height() / camera.fy);
  const double bend = distortion.rms();
  Eigen::Vector3d usual;
  usual << kSlopeOfBend * bend * px.cwiseInverse(), kConstantOfBend * bend / fb;
  auto found = depth_errors_of(steps, settings.mapper, usual, ended);
  if (!found) return std::nullopt;
  tell(*found, camera, px, metrics);
  if (!found->slopes.adopted && !found->focal.adopted) return std::nullopt;
  DepthDistortion with_slopes = distortion;
  with_slopes.add(found->camera(), *first);
  return with_slopes;
}

}  // namespace lamina
