// Three sensors' mountings, one after the other.
#include <lamina/apps/mounting_calibration.hpp>

#include <spdlog/spdlog.h>

#include <algorithm>

#include <lamina/frontend/odometry/matched_pieces.hpp>
#include <lamina/frontend/odometry/mounting_error.hpp>
#include <lamina/frontend/segments/ground_lines.hpp>
#include <lamina/frontend/segments/shared_walls.hpp>

namespace lamina::apps {
namespace {

bool is_level_scan(const Step& step) { return step.scan && step.scan_motion; }
bool is_other_scan(const Step& step) { return step.scan && !step.scan_motion; }
bool is_seen_by(const Step& step, SensorKind kind) {
  return !step.scan && step.observations.sensor == kind;
}
// What sees walls as areas.
constexpr SensorKind kImages[] = {SensorKind::kDepth, SensorKind::kStereo, SensorKind::kCloud};

bool is_image(const Step& step) {
  return std::any_of(std::begin(kImages), std::end(kImages),
                     [&step](SensorKind kind) { return is_seen_by(step, kind); });
}

// The scanner's mounting; nullopt without one, or where scans come from several: what corrects one
// would spoil the others.
std::optional<SE3> mounting_of(const std::vector<Step>& steps, bool (*is)(const Step&)) {
  std::optional<SE3> T_body_lidar;
  for (const Step& step : steps) {
    if (!is(step)) continue;
    const SE3& T = step.scan->lidar.T_body_lidar;
    if (!T_body_lidar) T_body_lidar = T;
    if ((T_body_lidar->inverse() * T).log().norm() > 1e-9) return std::nullopt;
  }
  return T_body_lidar;
}

std::optional<MountingCorrection> by_ground(const std::vector<Step>& steps) {
  GroundLines lines;
  for (const Step& step : steps) {
    if (is_other_scan(step)) lines.add(step.observations);
  }
  return lines.correction();
}

std::vector<PairedMotion> pieces_of(const std::vector<Step>& steps) {
  MatchedPieces pieces;
  for (const Step& step : steps) {
    if (!is_level_scan(step)) continue;
    const bool told = step.scan_motion->status != ScanMotion::Status::kPredicted;
    pieces.add(*step.scan, step.wheels_moved,
               told ? std::optional(step.scan_motion->T_prev_curr_body) : std::nullopt);
  }
  return pieces.pieces();
}

// `T_new_old`: how the scanner was remounted since the pieces were matched.
MountingError error_of(const std::vector<PairedMotion>& pieces, const SE3& T_new_old) {
  MountingError error;
  for (PairedMotion piece : pieces) {
    piece.scans = T_new_old * piece.scans * T_new_old.inverse();
    error.add(piece);
  }
  return error;
}

std::optional<MountingCorrection> by_travel(const MountingError& error) {
  constexpr double kLeast = 0.5 * M_PI / 180;  // wheels, too, are mounted no better
  const auto found = error.heading();
  if (!found || !found->adoption.adopted || std::abs(found->value) < kLeast) return std::nullopt;
  return MountingCorrection{{0, 0, -found->value}, Eigen::Vector3d::Zero()};
}

std::optional<MountingCorrection> by_turns(const MountingError& error) {
  constexpr double kLeast = 0.005;  // m: wheels turn about no finer a point
  // Beyond what the estimate's own prior holds possible it is no error but another frame: wheels
  // that turn about another point than the body's origin.
  constexpr double kMost = 3 * MountingError::kPlacePrior;
  const auto found = error.place();
  if (!found || !found->adoption.adopted) return std::nullopt;
  const double off = found->value.norm();
  if (off < kLeast) return std::nullopt;
  if (off > kMost) {
    spdlog::warn(
        "scanner sits ({:+.1f}, {:+.1f}) cm from where turns of the wheels have it: more than "
        "mountings err ({:.0f} cm), left as stated",
        100 * found->value.x(), 100 * found->value.y(), 100 * kMost);
    return std::nullopt;
  }
  return MountingCorrection{Eigen::Vector3d::Zero(), {-found->value.x(), -found->value.y(), 0}};
}

// Motions that scans told with a scanner said to sit elsewhere: a body that moves as this one does,
// corrected, is this one seen from a frame turned by T_new_old. What wheels alone told stays.
void turn_path(std::vector<Step>& steps, std::vector<LoopClosure>& loops, const SE3& T_new_old) {
  const SE3 T_old_new = T_new_old.inverse();
  SE3 T_old_since, T_new_since;  // from the last scan to the step before
  bool scanned = false;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    SE3& moved = steps[i].motion.T_from_to;
    if (i == 0) {
      scanned = steps[i].scan.has_value();
      continue;  // the first pose
    }
    const SE3 T_old = T_old_since * moved;
    if (!steps[i].scan) {
      moved = T_new_since.inverse() * T_old;
      T_old_since = T_new_since = T_old;
      continue;
    }
    const bool told = scanned && steps[i].scan_motion &&
                      steps[i].scan_motion->status != ScanMotion::Status::kPredicted;
    moved = T_new_since.inverse() * (told ? T_new_old * T_old * T_old_new : T_old);
    T_old_since = T_new_since = SE3();
    scanned = true;
  }
  for (LoopClosure& loop : loops) loop.T_from_to = T_new_old * loop.T_from_to * T_old_new;
}

std::optional<SharedWalls::Result> by_walls(const std::vector<Step>& steps, SensorKind kind) {
  SharedWalls walls;
  SE3 T_start_body;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i > 0) T_start_body = T_start_body * steps[i].motion.T_from_to;
    if (is_level_scan(steps[i])) walls.add_scan(steps[i].observations, T_start_body);
    if (is_seen_by(steps[i], kind)) walls.add_image(steps[i].observations, T_start_body);
  }
  return walls.result();
}

// How cameras sit to the scanner, where walls tell.
void relate_cameras(std::vector<Step>& steps, std::vector<CorrectedMounting>& all) {
  for (const SensorKind kind : kImages) {
    const bool any = std::any_of(steps.begin(), steps.end(),
                                 [kind](const Step& step) { return is_seen_by(step, kind); });
    if (!any) continue;
    const auto found = by_walls(steps, kind);
    if (!found || !found->stands_out) continue;
    for (Step& step : steps) {
      if (is_seen_by(step, kind)) remount(step, found->correction);
    }
    all.push_back({"camera",
                   "walls the scanner sees",
                   found->correction,
                   {0, 0, found->sigma(0)},
                   {found->sigma(1), found->sigma(2), 0}});
  }
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

MountingCalibration calibrate_mountings(std::vector<Step>& steps, std::vector<LoopClosure>& loops,
                                        bool planar) {
  MountingCalibration result;
  std::vector<CorrectedMounting>& all = result.corrected;
  const auto hanging =
      planar && mounting_of(steps, is_other_scan) ? by_ground(steps) : std::nullopt;
  if (hanging) {
    for (Step& step : steps) {
      if (is_other_scan(step)) remount(step, *hanging);
    }
    all.push_back({"scanner", "ground", *hanging});
  }
  const auto T_body_lidar = mounting_of(steps, is_level_scan);
  if (!T_body_lidar) return result;
  relate_cameras(steps, all);
  // Cameras move with the scanner: what relates them, walls or the calibration, still holds.
  SE3 T_new_old;
  const auto move_all = [&](const std::optional<MountingCorrection>& correction, const char* by) {
    if (!correction) return;
    const SE3 T_now = T_new_old * *T_body_lidar;
    const SE3 T_next_now = correction->apply(T_now) * T_now.inverse();
    turn_path(steps, loops, T_next_now);
    T_new_old = T_next_now * T_new_old;
    bool cameras = false;
    for (Step& step : steps) {
      if (!is_level_scan(step) && !is_image(step)) continue;
      cameras = cameras || is_image(step);
      remount(step, *correction);
    }
    all.push_back({"scanner", by, *correction});
    if (cameras) all.push_back({"camera", by, *correction});
  };
  if (planar) {
    const std::vector<PairedMotion> pieces = pieces_of(steps);
    move_all(by_travel(error_of(pieces, T_new_old)), "direction of travel");
    // A scanner said to sit in the very middle is one of which nobody said where it sits: the
    // body's poses are the scanner's own then, and stay so.
    const bool stated = !T_body_lidar->translation().head<2>().isZero(0);
    if (stated) move_all(by_turns(error_of(pieces, T_new_old)), "turns");
    result.left = error_of(pieces, T_new_old).evidence();
  }
  return result;
}

}  // namespace lamina::apps
