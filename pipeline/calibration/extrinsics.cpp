// Three sensors' mountings, one after the other.
#include <lamina/pipeline/calibration/extrinsics.hpp>

#include <algorithm>

#include <lamina/frontend/depth/mounting_check.hpp>
#include <lamina/pipeline/calibration/ground_lines.hpp>
#include <lamina/pipeline/calibration/matched_pieces.hpp>
#include <lamina/pipeline/calibration/mounting_error.hpp>
#include <lamina/pipeline/calibration/shared_walls.hpp>

namespace lamina {
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
    const bool observed = step.scan_motion->status != ScanMotion::Status::kPredicted;
    pieces.add(*step.scan, step.wheels_moved,
               observed ? std::optional(step.scan_motion->T_prev_curr_body) : std::nullopt);
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

// The place that turns tell, where it stands out from what is known of the wheels' middle: tyres,
// load and slip move the point that a body turns about by some centimetres.
std::optional<MountingError::Place> by_turns(const MountingError& error) {
  constexpr double kLeast = 0.05;  // m
  auto found = error.place();
  if (!found || !found->adoption.adopted || found->value.norm() < kLeast) return std::nullopt;
  return found;
}

// Beyond what the estimate's own prior holds possible it is no error of measuring, but a place
// stated wrong or for another frame of the body.
bool is_contradiction(const MountingError::Place& found) {
  return found.value.norm() > 4 * MountingError::kPlacePrior;
}

// As every contradiction, by half as many blocks as state a spread where these gain much.
bool wins_clearly(const MountingError::Place& found) {
  const AdoptionOptions options;
  const Adoption& by = found.adoption;
  const double sigma = std::sqrt(found.covariance.trace());
  return by.gain > MountingCheckOptions().wins_by && by.sigmas > options.least_sigmas &&
         2 * by.blocks >= options.least_blocks &&
         found.value.norm() > student_quantile(by.blocks - 1.0) * sigma;
}

MountingCorrection correction_by(const MountingError::Place& found) {
  return {Eigen::Vector3d::Zero(), {-found.value.x(), -found.value.y(), 0}};
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
    if (!found || !found->is_significant) continue;
    for (Step& step : steps) {
      if (is_seen_by(step, kind)) apply_correction(step, found->correction);
    }
    all.push_back({"camera",
                   "walls the scanner sees",
                   found->correction,
                   {0, 0, found->sigma(0)},
                   {found->sigma(1), found->sigma(2), 0}});
  }
}

int shared_walls(const std::vector<Step>& steps) {
  int pairs = 0;
  for (const SensorKind kind : kImages) {
    if (const auto found = by_walls(steps, kind)) pairs += found->pairs;
  }
  return pairs;
}

void apply_corrections(std::vector<Step>& steps, bool (*is)(const Step&),
                       const MountingCorrection& c) {
  for (Step& step : steps) {
    if (is(step)) apply_correction(step, c);
  }
}

// A level scanner, moved time and again; cameras move with it: what relates them, walls or the
// calibration, still holds.
class LevelScanner {
 public:
  LevelScanner(std::vector<Step>& steps, std::vector<LoopClosure>& loops, const SE3& T_body_lidar,
               std::vector<CorrectedMounting>& all)
      : steps_(steps), loops_(loops), T_body_lidar_(T_body_lidar), all_(all) {}

  MountingError error_of(const std::vector<PairedMotion>& pieces) const {
    return lamina::error_of(pieces, T_new_old_);
  }

  void move(const MountingCorrection& correction, const char* by) {
    move_scanner(correction, by);
    if (std::none_of(steps_.begin(), steps_.end(), is_image)) return;
    apply_corrections(steps_, is_image, correction);
    all_.push_back({"camera", by, correction});
  }

  // Corrected only where it wins clearly, and of cameras those stay which then see the same walls.
  std::optional<MountingContradiction> settle_contradiction(
      const std::vector<PairedMotion>& pieces) {
    const auto found = error_of(pieces).place();
    if (!found || !is_contradiction(*found)) return std::nullopt;
    const bool clear = wins_clearly(*found);
    if (!clear && !found->adoption.adopted) return std::nullopt;
    const Eigen::Vector2d stated = T_body_lidar_.translation().head<2>();
    MountingContradiction result{stated, stated - found->value,
                                 found->covariance.diagonal().cwiseSqrt(), clear, false};
    if (!result.corrected) return result;
    const MountingCorrection correction = correction_by(*found);
    const bool images = std::any_of(steps_.begin(), steps_.end(), is_image);
    const int together = images ? shared_walls(steps_) : 0;
    move_scanner(correction, "turns");
    result.cameras_too = images && shared_walls(steps_) <= together;
    if (!result.cameras_too) return result;
    apply_corrections(steps_, is_image, correction);
    all_.push_back({"camera", "turns", correction});
    return result;
  }

 private:
  void move_scanner(const MountingCorrection& correction, const char* by) {
    const SE3 T_now = T_new_old_ * T_body_lidar_;
    const SE3 T_next_now = correction.apply(T_now) * T_now.inverse();
    turn_path(steps_, loops_, T_next_now);
    T_new_old_ = T_next_now * T_new_old_;
    apply_corrections(steps_, is_level_scan, correction);
    all_.push_back({"scanner", by, correction});
  }

  std::vector<Step>& steps_;
  std::vector<LoopClosure>& loops_;
  SE3 T_body_lidar_;  // as stated
  std::vector<CorrectedMounting>& all_;
  SE3 T_new_old_;
};

}  // namespace

void apply_correction(Step& step, const MountingCorrection& correction) {
  Observations& o = step.observations;
  const SE3 T_body_sensor = correction.apply(o.T_body_sensor);
  const SE3 T_new_old = T_body_sensor * o.T_body_sensor.inverse();
  o.T_body_sensor = T_body_sensor;
  for (Surfel& surfel : o.surfels_body) surfel = surfel.transformed(T_new_old);
  for (Eigen::Vector3d& point : o.obstacle_points_body) point = T_new_old * point;
  step.T_body_levelled = T_new_old * step.T_body_levelled;
  if (step.scan) step.scan->lidar.T_body_lidar = correction.apply(step.scan->lidar.T_body_lidar);
}

// A body that moves as this one does, corrected, is this one seen from a frame turned by T_new_old.
// What wheels alone measured stays.
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
    const bool observed = scanned && steps[i].scan_motion &&
                          steps[i].scan_motion->status != ScanMotion::Status::kPredicted;
    moved = T_new_since.inverse() * (observed ? T_new_old * T_old * T_old_new : T_old);
    T_old_since = T_new_since = SE3();
    scanned = true;
  }
  for (LoopClosure& loop : loops) loop.T_from_to = T_new_old * loop.T_from_to * T_old_new;
}

MountingCalibration calibrate_mountings(std::vector<Step>& steps, std::vector<LoopClosure>& loops,
                                        bool planar) {
  MountingCalibration result;
  std::vector<CorrectedMounting>& all = result.corrected;
  const auto hanging =
      planar && mounting_of(steps, is_other_scan) ? by_ground(steps) : std::nullopt;
  if (hanging) {
    for (Step& step : steps) {
      if (is_other_scan(step)) apply_correction(step, *hanging);
    }
    all.push_back({"scanner", "ground", *hanging});
  }
  const auto T_body_lidar = mounting_of(steps, is_level_scan);
  if (!T_body_lidar) return result;
  // A scanner said to sit in the very middle is one of which nobody said where it sits: the
  // body's poses are the scanner's own then, and stay so.
  const bool stated = planar && !T_body_lidar->translation().head<2>().isZero(0);
  LevelScanner scanner(steps, loops, *T_body_lidar, all);
  const std::vector<PairedMotion> pieces = planar ? pieces_of(steps) : std::vector<PairedMotion>();
  if (stated) result.contradiction = scanner.settle_contradiction(pieces);
  relate_cameras(steps, all);
  if (!planar) return result;
  if (const auto turned = by_travel(scanner.error_of(pieces)))
    scanner.move(*turned, "direction of travel");
  const auto place = stated ? by_turns(scanner.error_of(pieces)) : std::nullopt;
  if (place && !is_contradiction(*place)) scanner.move(correction_by(*place), "turns");
  result.left = scanner.error_of(pieces).evidence();
  return result;
}

}  // namespace lamina
