// Three sensors' mountings, one after the other.
#include <lamina/apps/mounting_calibration.hpp>

#include <lamina/frontend/odometry/heading_error.hpp>
#include <lamina/frontend/segments/ground_lines.hpp>
#include <lamina/frontend/segments/shared_walls.hpp>

namespace lamina::apps {
namespace {

bool is_level_scan(const Step& step) { return step.scan && step.scan_motion; }
bool is_other_scan(const Step& step) { return step.scan && !step.scan_motion; }
bool is_image(const Step& step) {
  const SensorKind kind = step.observations.sensor;
  return kind == SensorKind::kDepth || kind == SensorKind::kStereo;
}

// The first level scan's mounting; nullopt without one.
std::optional<SE3> scanner_mounting(const std::vector<Step>& steps) {
  for (const Step& step : steps) {
    if (is_level_scan(step)) return step.scan->lidar.T_body_lidar;
  }
  return std::nullopt;
}

std::optional<MountingCorrection> by_ground(const std::vector<Step>& steps) {
  GroundLines lines;
  for (const Step& step : steps) {
    if (is_other_scan(step)) lines.add(step.observations);
  }
  return lines.correction();
}

std::optional<MountingCorrection> by_travel(const std::vector<Step>& steps) {
  constexpr double kStandsOut = 3;             // sigmas
  constexpr double kLeast = 0.5 * M_PI / 180;  // wheels, too, are mounted no better
  HeadingError heading;
  for (const Step& step : steps) {
    if (!is_level_scan(step)) continue;
    const bool tracked = step.scan_motion->status == ScanMotion::Status::kTracked;
    heading.add(step.wheels_moved,
                tracked ? std::optional(step.scan_motion->T_prev_curr_body) : std::nullopt);
  }
  const auto found = heading.result();
  if (!found || std::abs(found->value) < std::max(kLeast, kStandsOut * found->sigma))
    return std::nullopt;
  return MountingCorrection{{0, 0, found->value}, Eigen::Vector3d::Zero()};
}

// Motions of the body that scans told with a scanner mounted at T_body_lidar: a body that moves as
// this one does, corrected, is this one seen from a frame turned by T_new_old.
void turn_path(std::vector<Step>& steps, std::vector<LoopClosure>& loops, const SE3& T_new_old) {
  const SE3 T_old_new = T_new_old.inverse();
  SE3 T_old, T_new;            // of the step before, from the first
  SE3 T_old_scan, T_new_scan;  // of the last scan
  for (std::size_t i = 1; i < steps.size(); ++i) {
    SE3& moved = steps[i].motion.T_from_to;
    const SE3 T_new_before = T_new;
    T_old = T_old * moved;
    if (steps[i].scan) {
      T_old_scan = T_old;
      T_new_scan = T_new_old * T_old * T_old_new;
    }
    T_new = T_new_scan * (T_old_scan.inverse() * T_old);
    moved = T_new_before.inverse() * T_new;
  }
  for (LoopClosure& loop : loops) loop.T_from_to = T_new_old * loop.T_from_to * T_old_new;
}

std::optional<MountingCorrection> by_walls(const std::vector<Step>& steps) {
  SharedWalls walls;
  SE3 T_start_body;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i > 0) T_start_body = T_start_body * steps[i].motion.T_from_to;
    if (is_level_scan(steps[i])) walls.add_scan(steps[i].observations, T_start_body);
    if (is_image(steps[i])) walls.add_image(steps[i].observations, T_start_body);
  }
  const auto found = walls.result();
  return found ? std::optional(found->correction) : std::nullopt;
}

}  // namespace

void remount(Step& step, const MountingCorrection& correction) {
  Observations& o = step.observations;
  const SE3 T_body_sensor = correction.apply(o.T_body_sensor);
  const SE3 T_new_old = T_body_sensor * o.T_body_sensor.inverse();
  o.T_body_sensor = T_body_sensor;
  for (Surfel& surfel : o.surfels_body) surfel = surfel.transformed(T_new_old);
  for (Eigen::Vector3d& point : o.obstacle_points_body) point = T_new_old * point;
  step.T_body_levelled = T_new_old * step.T_body_levelled;
  if (step.scan) step.scan->lidar.T_body_lidar = correction.apply(step.scan->lidar.T_body_lidar);
}

std::vector<CorrectedMounting> calibrate_mountings(std::vector<Step>& steps,
                                                   std::vector<LoopClosure>& loops, bool planar) {
  std::vector<CorrectedMounting> all;
  if (const auto correction = planar ? by_ground(steps) : std::nullopt) {
    for (Step& step : steps) {
      if (is_other_scan(step)) remount(step, *correction);
    }
    all.push_back({"scanner", "ground", *correction});
  }
  const auto T_body_lidar = scanner_mounting(steps);
  if (!T_body_lidar) return all;
  if (const auto correction = planar ? by_travel(steps) : std::nullopt) {
    turn_path(steps, loops, correction->apply(*T_body_lidar) * T_body_lidar->inverse());
    for (Step& step : steps) {
      if (is_level_scan(step)) remount(step, *correction);
    }
    all.push_back({"scanner", "direction of travel", *correction});
  }
  if (const auto correction = by_walls(steps)) {
    for (Step& step : steps) {
      if (is_image(step)) remount(step, *correction);
    }
    all.push_back({"camera", "walls the scanner sees", *correction});
  }
  return all;
}

}  // namespace lamina::apps
