// A map to learn from, and what it says put into steps or a session.
#include <lamina/pipeline/extrinsics_refinement.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <lamina/backend/mapper/observing_sensor.hpp>
#include <lamina/pipeline/calibration/block_maps.hpp>
#include <lamina/pipeline/calibration/calibration_report.hpp>
#include <lamina/pipeline/calibration/extrinsics.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>
#include <lamina/pipeline/loop_factors.hpp>

namespace lamina {
namespace {

const char* const kNames[] = {"x_error_cm",     "y_error_cm",      "z_error_cm",
                              "roll_error_deg", "pitch_error_deg", "yaw_error_deg"};

// What must be done to a mounting: moved (m), then turned about the sensor (rad), body axes.
Vector6d by_body_axes(const SE3& from, const SE3& to) {
  Vector6d d;
  d << to.translation() - from.translation(), (to.so3() * from.so3().inverse()).log();
  return d;
}

Vector6d sigmas_along_body_axes(const FoundExtrinsics& f) {
  Matrix6d R = Matrix6d::Zero();
  R.topLeftCorner<3, 3>() = R.bottomRightCorner<3, 3>() = f.stated.so3().matrix();
  return (R * f.covariance * R.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
}

Mapper mapped(const std::vector<Step>& steps, const std::vector<LoopClosure>& loops,
              const MapperOptions& options, const std::function<bool()>& ended) {
  Mapper mapper(options);
  LoopBook book;
  for (const Step& step : steps) {
    if (ended()) break;
    const AddResult added = mapper.add(step.observations, step.motion.T_from_to,
                                       step.motion.covariance, observed_by_sensor(step));
    if (step.scan) book.note(step.observations, added, mapper);
  }
  book.transfer(loops, mapper);
  RefineOptions quick;
  quick.thorough = false;
  mapper.refine(quick, [&](const RefineProgress&) { return !ended(); });
  return mapper;
}

// What a block's map says of the sensors of `of`, in their order; those it does not show: nothing.
QuadraticBlock in_order_of(const ExtrinsicsEstimate& of, const ExtrinsicsEstimate& block,
                           const Eigen::MatrixXd& prior) {
  const QuadraticBlock own = without_prior(
      block.value, block.covariance, prior.topLeftCorner(block.value.size(), block.value.size()));
  QuadraticBlock result{Eigen::MatrixXd::Zero(of.value.size(), of.value.size()),
                        Eigen::VectorXd::Zero(of.value.size())};
  const auto place = [&of](const FoundExtrinsics& f) -> Eigen::Index {
    const auto same = std::find_if(of.sensors.begin(), of.sensors.end(),
                                   [&f](const auto& other) { return other.sensor == f.sensor; });
    return same == of.sensors.end() ? -1 : 6 * (same - of.sensors.begin());
  };
  for (std::size_t i = 0; i < block.sensors.size(); ++i) {
    const Eigen::Index to_i = place(block.sensors[i]);
    if (to_i < 0) continue;
    const auto at_i = static_cast<Eigen::Index>(6 * i);
    result.b.segment<6>(to_i) += own.b.segment<6>(at_i);
    for (std::size_t j = 0; j < block.sensors.size(); ++j) {
      const Eigen::Index to_j = place(block.sensors[j]);
      if (to_j >= 0)
        result.H.block<6, 6>(to_i, to_j) +=
            own.H.block<6, 6>(at_i, static_cast<Eigen::Index>(6 * j));
    }
  }
  return result;
}

Adoption by_blocks(const std::vector<Step>& steps, const ExtrinsicsEstimate& found,
                   const CalibrationOptions& settings, const std::function<bool()>& ended) {
  const ExtrinsicsOptions options = extrinsics_options(settings);
  const Eigen::Index size = found.value.size();
  Eigen::VectorXd sigma(size);
  for (Eigen::Index i = 0; i < size; ++i)
    sigma(i) = i % 6 < 3 ? options.sigma_place_m : options.sigma_turn_deg * M_PI / 180;
  const Eigen::MatrixXd prior = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  const auto blocks = evidence_by_blocks(
      steps, settings.mapper,
      [&](const Graph& graph) -> std::optional<QuadraticBlock> {
        const auto block = estimate_extrinsics(graph, options);
        if (!block || block->value.size() > size) return std::nullopt;
        return in_order_of(found, *block, prior);
      },
      ended);
  const Eigen::MatrixXd held = 1e10 * Eigen::MatrixXd::Identity(size, size);  // 1e-5 m, rad
  return judge(blocks, held, prior).adoption;
}

// In every step, and in the motions and loops that its own sensor measured.
void correct(std::vector<Step>& steps, std::vector<LoopClosure>& loops, Graph graph,
             const ExtrinsicsEstimate& estimate) {
  std::map<ExtrinsicsId, const FoundExtrinsics*> by_id;
  int scanners = 0;
  for (const FoundExtrinsics& f : estimate.sensors) by_id[f.id] = &f;
  for (const FoundExtrinsics& f : estimate.sensors) {
    if (f.sensor != "lidar") continue;
    if (++scanners == 1) turn_path(steps, loops, f.found * f.stated.inverse());
  }
  for (std::size_t i = 0; i < steps.size(); ++i) {
    Step& step = steps[i];
    const auto found = by_id.find(observing_sensor(step.observations, graph));
    if (found == by_id.end()) continue;
    const FoundExtrinsics& f = *found->second;
    if (i > 0 && !step.scan && observed_by_sensor(step)) {
      const SE3 T_new_old = f.found * f.stated.inverse();
      step.motion.T_from_to = T_new_old * step.motion.T_from_to * T_new_old.inverse();
    }
    const Vector6d by = by_body_axes(f.stated, f.found);
    apply_correction(step, {by.tail<3>(), by.head<3>()});
  }
}

// Scans and views of a session, where one sensor can have made them.
void move_views(io::Session& session, const SE3& of_scans, const SE3& of_images) {
  for (KeptScan& kept : session.scans) {
    SE3& T = kept.scan.lidar.T_body_lidar;
    T = (kept.from_depth ? of_images : of_scans) * T;
  }
  for (SeenRims& seen : session.rims) seen.T_body_levelled = of_images * seen.T_body_levelled;
  for (SeenGround& seen : session.ground) seen.T_body_levelled = of_images * seen.T_body_levelled;
  for (SeenDepth& seen : session.sights) seen.T_body_camera = of_images * seen.T_body_camera;
}

std::optional<ExtrinsicsEstimate> estimate(const Mapper& mapper,
                                           const CalibrationOptions& settings) {
  auto found = mapper.estimate_extrinsics(extrinsics_options(settings));
  if (!found) {
    run_log().info("extrinsics: not estimated, the ground swells or no sensor saw a plane");
  }
  return found;
}

}  // namespace

ExtrinsicsOptions extrinsics_options(const CalibrationOptions& settings) {
  ExtrinsicsOptions options;
  options.engine = settings.mapper.window.engine;
  options.sigma_place_m = std::max(1e-6, settings.mounting_sigma_place_m);
  options.sigma_turn_deg = std::max(1e-6, settings.mounting_sigma_heading_deg);
  return options;
}

void tell_extrinsics(const ExtrinsicsEstimate& estimate, const Adoption& adoption,
                     Diagnostics& metrics) {
  const double degree = M_PI / 180;
  for (const FoundExtrinsics& f : estimate.sensors) {
    const Vector6d off = by_body_axes(f.stated, f.found), sigma = sigmas_along_body_axes(f);
    const double units[] = {0.01, 0.01, 0.01, degree, degree, degree};
    std::string open;
    for (int k = 0; k < 6; ++k) {
      Estimate one{f.sensor + "." + kNames[k], 0, -off(k) / units[k], sigma(k) / units[k],
                   adoption};
      const bool observed = f.observed_share(k) > 0.25;  // of what relates two sensors: half
      one.adoption.adopted = adoption.adopted && observed;
      report(one, metrics);
      if (!observed) open += fmt::format("{}{}", open.empty() ? "" : ", ", kNames[k]);
    }
    if (!open.empty()) run_log().info("{}: not observed, as stated: {}", f.sensor, open);
  }
  run_log().info("extrinsics: total {:.0f} as stated, {:.0f} free, price {:.0f}",
                 estimate.total_stated, estimate.total_free, estimate.price);
}

void refine_extrinsics(std::vector<Step>& steps, std::vector<LoopClosure>& loops,
                       const CalibrationOptions& settings, Diagnostics& metrics,
                       const std::function<bool()>& ended) {
  const auto timer = metrics.time("extrinsics");
  const Mapper mapper = mapped(steps, loops, settings.mapper, ended);
  if (ended()) return;
  const auto found = estimate(mapper, settings);
  if (!found) return;
  Adoption adoption;
  if (found->adopted) adoption = by_blocks(steps, *found, settings, ended);
  if (ended()) return;
  tell_extrinsics(*found, adoption, metrics);
  if (adoption.adopted) correct(steps, loops, mapper.graph(), *found);
}

void refine_extrinsics(io::Session& session, const CalibrationOptions& settings,
                       Diagnostics& metrics, const std::function<bool()>& ended) {
  const auto timer = metrics.time("extrinsics");
  Mapper mapper(settings.mapper, session.map);
  RefineOptions quick;
  quick.thorough = false;
  mapper.refine(quick, [&](const RefineProgress&) { return !ended(); });
  if (ended()) return;
  const auto found = estimate(mapper, settings);
  if (!found) return;
  Adoption adoption;
  adoption.adopted = found->adopted;
  adoption.gain = found->total_stated - found->total_free - found->price;
  tell_extrinsics(*found, adoption, metrics);
  if (!found->adopted) return;
  const SensorMotions moved = mount(session.map, found->sensors);
  move_views(session, moved.of_scans, moved.of_images);
}

}  // namespace lamina
