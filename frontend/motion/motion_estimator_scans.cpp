// A scan's motion: straightened, matched, doubted, remembered.
#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/frontend/motion/deskew.hpp>
#include <lamina/frontend/motion/motion_covariances.hpp>
#include <lamina/frontend/motion/motion_estimator.hpp>
#include <lamina/frontend/motion/planar.hpp>
#include <lamina/frontend/segments/ground_returns.hpp>

namespace lamina {
namespace {

constexpr int kRounds = 3;  // of straightening a scan by its own motion

// A scan that fits nowhere while the wheels go on (the robot tipped) is no view of the place.
bool shows_nothing(const ScanMotion& motion) {
  const bool observed = motion.status != ScanMotion::Status::kFirst &&
                        (motion.status != ScanMotion::Status::kPredicted || motion.wheels_went_on);
  return observed && motion.iterations == 0;
}

// The velocity that a scan without wheels tells by its own motion, where the scan was straightened
// by another. (By the last one's throughout, an error would come back with the other sign, scan
// after scan.)
std::optional<Vector6d> other_velocity(double dt, double sweep, const ScanMotion& motion,
                                       const std::optional<Vector6d>& used) {
  constexpr double kMetres = 0.002, kRadians = 0.001;  // over the sweep
  if (motion.status == ScanMotion::Status::kPredicted || !(dt > 0)) return std::nullopt;
  const Vector6d velocity = motion.T_prev_curr_body.log() / dt;
  const Vector6d off = sweep * (velocity - used.value_or(Vector6d::Zero()));
  if (off.head<3>().norm() < kMetres && off.tail<3>().norm() < kRadians) return std::nullopt;
  return velocity;
}

// Wheels as a start for scans, not sure of their scale. In the local map, of length L, an error of
// scale is the same in every step: it displaces scans by scale L, as steps t of independent noise
// do with a variance of scale^2 L |t| each.
Matrix6d of_unknown_scale(const Increment& wheels, const ScanOdometryOptions& options) {
  constexpr double kScale = 0.05;
  const double length = options.key_scans * options.key_translation;
  Matrix6d covariance = wheels.covariance;
  const Eigen::Vector3d& t = wheels.T_from_to.translation();
  if (const double way = t.norm(); way > 0)
    covariance.topLeftCorner<3, 3>() += kScale * kScale * length / way * t * t.transpose();
  return covariance;
}

}  // namespace

// A scan as measured, and straightened.
struct MotionEstimator::Straightening {
  const LaserScan& measured;
  bool level = false;
  double sweep = 0;                  // s
  std::optional<Vector6d> velocity;  // it was straightened by
  bool by_itself = false;            // velocity is that of the scans before
  LaserScan scan;
  std::int64_t ground = 0;  // returns that were left out
};

void MotionEstimator::straighten_by(const std::optional<Vector6d>& velocity,
                                    Straightening& s) const {
  s.velocity = velocity;
  const double beams = static_cast<double>(std::max<std::size_t>(s.measured.size(), 2) - 1);
  s.scan = velocity ? straightened(s.measured, s.sweep / beams, *velocity) : s.measured;
  if (s.level) s.scan.lidar.T_body_lidar = level_scanner_.apply(s.scan.lidar.T_body_lidar);
  s.ground = s.level && planar_ ? remove_ground(s.scan) : 0;
}

MotionEstimator::Straightening MotionEstimator::straighten(const LaserScan& measured) const {
  const bool level = is_level(measured.lidar.T_body_lidar, max_tilt_);
  Straightening s{measured, level, 0, {}, false, {}, 0};
  s.sweep = level ? duration_.of(measured) : 0;
  std::optional<Vector6d> velocity;
  if (s.sweep != 0) {
    const Timestamp other = measured.stamp + s.sweep;
    velocity = wheels_.velocity(std::min(measured.stamp, other), std::max(measured.stamp, other));
  }
  s.by_itself = s.sweep != 0 && !velocity && scan_.stamp.has_value();
  if (s.by_itself) velocity = last_scan_velocity();
  straighten_by(velocity, s);
  return s;
}

std::optional<Vector6d> MotionEstimator::last_scan_velocity() const {
  if (!(scan_.interval > 0)) return std::nullopt;
  return Vector6d(scan_.moved.log() / scan_.interval);
}

std::optional<MotionGuess> MotionEstimator::guess(Timestamp stamp,
                                                  const std::optional<Increment>& wheels) const {
  if (const auto moved = wheels_.corrected(wheels)) {
    return MotionGuess{moved->T_from_to, scans_tell_scale_
                                             ? of_unknown_scale(*moved, scan_odometry_.options())
                                             : moved->covariance};
  }
  if (const auto gap = wheels_.across_hole(scan_.T_start_body, stamp); gap && scan_.stamp)
    return MotionGuess{gap->T_from_to, gap->covariance - wheels_.guessed_in_hole()};
  return scanned_of_late(stamp) ? std::nullopt : bridged_since_scan();
}

// Matching scans tells the motion in the plane of a level scanner. What it cannot tell, odometry
// of six degrees may: height, roll and pitch, and all of it where the scanner looks another way.
ScanMotion MotionEstimator::move_by_scan(const LaserScan& scan,
                                         const std::optional<MotionGuess>& guess, bool level) {
  if (!level && guess) {
    ScanMotion motion;
    motion.T_prev_curr_body = guess->T_prev_curr_body;
    motion.covariance = guess->covariance;
    motion.status = ScanMotion::Status::kPredicted;
    return motion;
  }
  ScanMotion motion = scan_odometry_.process(scan, guess, slopes_.of_late(scan.stamp));
  if (!planar_ && guess) {
    const SE3 flat = lifted(planar_part(guess->T_prev_curr_body));
    motion.T_prev_curr_body = motion.T_prev_curr_body * (flat.inverse() * guess->T_prev_curr_body);
  }
  return motion;
}

// Where wheels did not tell the motion within the scan, its own does.
ScanMotion MotionEstimator::match(Straightening& s, const std::optional<MotionGuess>& guess,
                                  Diagnostics& diagnostics) {
  const auto timer = diagnostics.time("odometry");
  if (!s.by_itself) return move_by_scan(s.scan, guess, s.level);
  const ScanOdometry before = scan_odometry_;
  ScanMotion motion = move_by_scan(s.scan, guess, s.level);
  for (int round = 0; round < kRounds; ++round) {
    const auto other = other_velocity(s.scan.stamp - *scan_.stamp, s.sweep, motion, s.velocity);
    if (!other) break;
    straighten_by(other, s);
    scan_odometry_ = before;
    motion = move_by_scan(s.scan, guess, s.level);
  }
  return motion;
}

// Once the duration is found, scans are straightened from the next one on.
void MotionEstimator::watch_duration(const LaserScan& measured,
                                     const std::optional<Increment>& wheels,
                                     const ScanMotion& motion, Diagnostics& diagnostics) {
  if (!duration_.watches(measured)) return;
  const auto timer = diagnostics.time("scanner_sweep");
  std::optional<SE3> moved;
  bool finely = false;
  if (wheels) {
    moved = wheels->T_from_to;
    finely = scan_.stamp && wheels_.track().several_within(*scan_.stamp, measured.stamp);
  } else if (scan_.stamp && motion.status == ScanMotion::Status::kTracked) {
    moved = motion.T_prev_curr_body;
  }
  duration_.add(measured, moved, finely);
}

MatchedScan MotionEstimator::match(const LaserScan& measured, Diagnostics& diagnostics) {
  Straightening s = straighten(measured);
  MatchedScan matched;
  matched.level = s.level;
  matched.wheels = measured_by_wheels(scan_.stamp, measured.stamp);
  const std::optional<MotionGuess> guess = this->guess(measured.stamp, matched.wheels);
  matched.guessed = guess.has_value();
  matched.motion = match(s, guess, diagnostics);
  if (s.level && shows_nothing(matched.motion)) {
    diagnostics.counts.scans_left_out += 1;
    std::fill(s.scan.ranges.begin(), s.scan.ranges.end(), HUGE_VALF);
  }
  if (s.level) watch_duration(measured, matched.wheels, matched.motion, diagnostics);
  if (s.level && planar_)
    diagnostics.counts.ground_returns = static_cast<double>(ground_returns_ += s.ground);
  if (scan_.stamp) matched.moved = matched.motion.T_prev_curr_body;
  // Of a level scanner's first look over wheels, nobody asks for walls.
  matched.wants_walls = !(scans_tell_scale_ && s.level);
  matched.scan = std::move(s.scan);
  return matched;
}

// Returns enough to tell, none of them where they should be. Where they are, but too noisy to say
// more than the wheels, those are to be believed; so are wheels that go on while people or glass
// hide for one scan what stands there.
bool MotionEstimator::carried_away_by(const ScanMotion& motion, bool guessed) const {
  constexpr std::size_t kEnough = 30;
  const bool fits = motion.matched >= scan_odometry_.options().lost_matched;
  return motion.status == ScanMotion::Status::kPredicted && !motion.wheels_went_on &&
         !(guessed && fits) && scan_odometry_.last_points().size() >= kEnough;
}

// Where the match says nothing, or what it says is no motion.
void MotionEstimator::check_match(const MatchedScan& matched, ScanMotion& motion,
                                  Step& step) const {
  const bool followed = matched.level && scan_.stamp;
  const bool carried = followed && carried_away_by(motion, matched.guessed);
  if (carried) motion.covariance += carried_away();
  // Too few returns to tell, and no wheels that would.
  const bool predicted = motion.status == ScanMotion::Status::kPredicted;
  step.tracking_lost = step.tracking_lost || carried || (followed && !matched.guessed && predicted);
  if (!matched.contradicted) return;
  motion.covariance += matched.leap
                           ? leap_of_unknown_size(*matched.leap, matched.scan.lidar.T_body_lidar)
                           : any_motion();
  step.tracking_lost = !matched.leap;
}

// Where the first scan was taken: images may have come before it.
void MotionEstimator::begin_scans(Timestamp stamp, Step& step, ScanMotion& motion) {
  scan_.T_start_body = dead_reckoned(stamp);
  if (!last_step_) return;
  std::optional<Increment> moved = wheels_.corrected(measured_by_wheels(last_step_, stamp));
  if (!moved) {
    moved = coasted(stamp, step);
    if (!step.tracking_lost) moved->covariance = held_to_floor(moved->covariance);
  }
  scan_.T_start_body = T_start_body_ * moved->T_from_to;
  motion.covariance = moved->covariance;
}

void MotionEstimator::accept(const MatchedScan& matched, Step& step) {
  const Timestamp stamp = matched.scan.stamp;
  ScanMotion motion = matched.motion;
  if (matched.wheels) step.wheels_moved = matched.wheels->T_from_to;
  const bool first = !scan_.stamp;
  if (first) begin_scans(stamp, step, motion);
  SE3 T_start_body = scan_.T_start_body * motion.T_prev_curr_body;
  if (scan_.lifted) T_start_body = T_start_body * *scan_.lifted;
  check_match(matched, motion, step);
  step.motion = advance(T_start_body, held_level(motion.covariance), stamp);
  if (!first) {
    step.motion_known =
        (matched.guessed && !step.tracking_lost) || motion.status == ScanMotion::Status::kTracked;
    step.open_direction = !matched.guessed && motion.status == ScanMotion::Status::kDegenerate;
  }
  point_up(step);
  step.T_start_body = T_start_body;
  remember(matched, motion, step);
  wheels_.learn(stamp, matched.wheels, motion.by_scans_alone);
}

void MotionEstimator::remember(const MatchedScan& matched, const ScanMotion& motion, Step& step) {
  const Timestamp stamp = matched.scan.stamp;
  scan_.left_to_wheels =
      step.wheels_moved && matched.level ? motion.left_to_wheels : LeftToWheels();
  step.left_to_wheels = scan_.left_to_wheels;
  scan_.lifted.reset();
  scan_.T_start_body = step.T_start_body;
  if (scan_.stamp) {
    scan_.interval = stamp - *scan_.stamp;
    scan_.moved = motion.T_prev_curr_body;
  }
  scan_.stamp = stamp;
  scan_.since.reset();
  if (step.motion_known && !step.tracking_lost) last_observed_ = stamp;
  if (matched.level) step.scan_motion = motion;
}

// Scans go on: a step between two of them is theirs to tell.
bool MotionEstimator::scanned_of_late(Timestamp stamp) const {
  constexpr double kIntervals = 2.5;
  return scan_.stamp && stamp - *scan_.stamp <= kIntervals * scan_.interval;
}

// How the body came from the last scan to here, where that is known well enough to lay the next
// one.
std::optional<MotionGuess> MotionEstimator::bridged_since_scan() const {
  constexpr double kMostMetres = 0.5, kMostTurn = 0.3;  // m, rad; 1-sigma
  if (!scan_.stamp || !scan_.since) return std::nullopt;
  if (!(scan_.interval > 0) && !image_.velocity) return std::nullopt;  // no image told a motion yet
  const Vector6d sigma = scan_.since->diagonal().cwiseSqrt();
  if (!(sigma.head<2>().maxCoeff() < kMostMetres) || !(sigma(5) < kMostTurn)) return std::nullopt;
  return MotionGuess{scan_.T_start_body.inverse() * T_start_body_, *scan_.since};
}

}  // namespace lamina
