// A scan's way through the front-end: straightened, matched, doubted, remembered.
#include <algorithm>
#include <utility>

#include <lamina/frontend/frontend.hpp>
#include <lamina/frontend/motion/motion_covariances.hpp>

namespace lamina {
namespace {

constexpr int kRounds = 3;  // of straightening a scan by its own motion

// A scan that fits nowhere while the wheels go on (the robot tipped) is no view of the place.
bool shows_nothing(const ScanMotion& motion) {
  const bool observed = motion.status != ScanMotion::Status::kFirst &&
                        (motion.status != ScanMotion::Status::kPredicted || motion.wheels_went_on);
  return observed && motion.iterations == 0;
}

}  // namespace

bool is_level(const SE3& T_body_lidar, double max_tilt) {
  const Eigen::Vector3d z_body = T_body_lidar.so3() * Eigen::Vector3d::UnitZ();
  return std::abs(z_body.z()) >= std::cos(max_tilt);
}

// A scan as measured, and straightened.
struct FrontEnd::ScanOnItsWay {
  const LaserScan& measured;
  bool level = false;
  double sweep = 0;                  // s
  std::optional<Vector6d> velocity;  // it was straightened by
  bool by_itself = false;            // velocity is that of the scans before
  LaserScan scan;
  std::int64_t ground = 0;  // returns
};

FrontEnd::ScanOnItsWay FrontEnd::on_its_way(const LaserScan& measured) const {
  const bool level = is_level(measured.lidar.T_body_lidar, max_tilt_);
  ScanOnItsWay way{measured, level, 0, {}, false, {}, 0};
  way.sweep = way.level ? sweep_of(measured) : 0;
  if (way.sweep != 0) way.velocity = wheels_in(measured, way.sweep);
  way.by_itself = way.sweep != 0 && !way.velocity && last_scan_.has_value();
  if (way.by_itself) way.velocity = last_velocity();
  way.scan = prepared(measured, way.level, way.sweep, way.velocity, way.ground);
  return way;
}

std::optional<MotionGuess> FrontEnd::guess(Timestamp stamp, const std::optional<Increment>& wheels,
                                           Step& step) const {
  if (const auto moved = without_systematic_errors(wheels)) {
    step.wheels_moved = wheels->T_from_to;
    return MotionGuess{moved->T_from_to,
                       scans_tell_scale_ ? of_unknown_scale(*moved) : moved->covariance};
  }
  if (const auto gap = across_hole(T_start_scan_body_, stamp); gap && last_scan_)
    return MotionGuess{gap->T_from_to, gap->covariance - met_last_->since};
  return scanned_of_late(stamp) ? std::nullopt : bridged_since_scan();
}

ScanMotion FrontEnd::match(ScanOnItsWay& way, const std::optional<MotionGuess>& guess,
                           Diagnostics& metrics) {
  const auto timer = metrics.time("odometry");
  if (!way.by_itself) return move_by_scan(way.scan, guess, way.level);
  const ScanOdometry before = scan_odometry_;
  ScanMotion motion = move_by_scan(way.scan, guess, way.level);
  for (int round = 0; round < kRounds; ++round) {
    const auto other =
        other_velocity(way.scan.stamp - *last_scan_, way.sweep, motion, way.velocity);
    if (!other) break;
    way.velocity = other;
    way.scan = prepared(way.measured, way.level, way.sweep, way.velocity, way.ground);
    scan_odometry_ = before;
    motion = move_by_scan(way.scan, guess, way.level);
  }
  return motion;
}

void FrontEnd::check_match(const ScanOnItsWay& way, bool guessed, ScanMotion& motion, Step& step) {
  const bool carried = way.level && last_scan_ && lost(motion, guessed);
  if (carried) motion.covariance += carried_away();
  // Too few returns to tell, and no wheels that would.
  const bool predicted = motion.status == ScanMotion::Status::kPredicted;
  step.tracking_lost =
      step.tracking_lost || carried || (way.level && last_scan_ && !guessed && predicted);
  if (way.level || !guessed || !segments_.tracker().contradicted()) return;
  ++skipped_["odometry that every scan line contradicts"];
  const std::optional<Vector6d>& leap = segments_.tracker().leap();
  motion.covariance +=
      leap ? leap_of_unknown_size(*leap, way.scan.lidar.T_body_lidar) : any_motion();
  step.tracking_lost = !leap;
}

std::optional<Step> FrontEnd::process_scan(const LaserScan& measured, Diagnostics& metrics) {
  if (!meet(measured.stamp)) return std::nullopt;
  ScanOnItsWay way = on_its_way(measured);
  Step step;
  const std::optional<Increment> wheels = measured_way(last_scan_, measured.stamp);
  const std::optional<MotionGuess> guess = this->guess(measured.stamp, wheels, step);
  ScanMotion motion = match(way, guess, metrics);
  if (way.level && shows_nothing(motion)) {
    metrics.counts.scans_left_out += 1;
    std::fill(way.scan.ranges.begin(), way.scan.ranges.end(), HUGE_VALF);
  }
  if (way.level) watch_sweep(measured, wheels, motion, metrics);
  if (way.level && planar_)
    metrics.counts.ground_returns = static_cast<double>(ground_returns_ += way.ground);
  // Of a level scanner's first look over wheels, nobody asks for walls.
  if (!(scans_tell_scale_ && way.level)) {
    const auto timer = metrics.time("segments");
    step.observations = segments_.process(
        way.scan, last_scan_ ? std::optional<SE3>(motion.T_prev_curr_body) : std::nullopt);
  }
  if (!last_scan_) begin_scans(measured.stamp, step, motion);
  SE3 T_start_body = T_start_scan_body_ * motion.T_prev_curr_body;
  if (lifted_since_scan_) T_start_body = T_start_body * *lifted_since_scan_;
  check_match(way, guess.has_value(), motion, step);
  step.motion = advance(T_start_body, held_level(motion.covariance), measured.stamp);
  if (last_scan_) {
    step.motion_known =
        (guess.has_value() && !step.tracking_lost) || motion.status == ScanMotion::Status::kTracked;
    step.open_direction = !guess && motion.status == ScanMotion::Status::kDegenerate;
  }
  point_up(step);
  remember(way, motion, T_start_body, step);
  learned_.add(*last_scan_, wheels, motion.by_scans_alone);
  step.scan = std::move(way.scan);
  return step;
}

void FrontEnd::remember(const ScanOnItsWay& way, const ScanMotion& motion, const SE3& T_start_body,
                        Step& step) {
  scan_left_ = step.wheels_moved && way.level ? motion.left_to_wheels : LeftToWheels();
  step.left_to_wheels = scan_left_;
  lifted_since_scan_.reset();
  T_start_scan_body_ = T_start_body;
  if (last_scan_) {
    scan_interval_ = way.scan.stamp - *last_scan_;
    scan_step_ = motion.T_prev_curr_body;
  }
  last_scan_ = way.scan.stamp;
  since_scan_.reset();
  if (step.motion_known && !step.tracking_lost) last_observed_ = way.scan.stamp;
  step.T_start_body = T_start_body;
  if (way.level) step.scan_motion = motion;
}

// Where the first scan was taken: images may have come before it.
void FrontEnd::begin_scans(Timestamp stamp, Step& step, ScanMotion& motion) {
  T_start_scan_body_ = dead_reckoned(stamp);
  if (!last_step_) return;
  std::optional<Increment> moved = driven(last_step_, stamp);
  if (!moved) {
    moved = coasted(stamp, step);
    if (!step.tracking_lost) moved->covariance = held_to_floor(moved->covariance);
  }
  T_start_scan_body_ = T_start_body_ * moved->T_from_to;
  motion.covariance = moved->covariance;
}

// Returns enough to tell, none of them where they should be. Where they are, but too noisy to say
// more than the wheels, those are to be believed; so are wheels that go on while people or glass
// hide for one scan what stands there.
bool FrontEnd::lost(const ScanMotion& motion, bool guessed) const {
  constexpr std::size_t kEnough = 30;
  const bool fits = motion.matched >= scan_odometry_.options().lost_matched;
  return motion.status == ScanMotion::Status::kPredicted && !motion.wheels_went_on &&
         !(guessed && fits) && scan_odometry_.last_points().size() >= kEnough;
}

// Matching scans tells the motion in the plane of a level scanner. What it cannot tell, odometry
// of six degrees may: height, roll and pitch, and all of it where the scanner looks another way.
ScanMotion FrontEnd::move_by_scan(const LaserScan& scan, const std::optional<MotionGuess>& guess,
                                  bool level) {
  if (!level && guess) {
    ScanMotion motion;
    motion.T_prev_curr_body = guess->T_prev_curr_body;
    motion.covariance = guess->covariance;
    motion.status = ScanMotion::Status::kPredicted;
    return motion;
  }
  ScanMotion motion = scan_odometry_.process(scan, guess, slopes_of_late(scan.stamp));
  if (!planar_ && guess) {
    const SE3 flat = lifted(planar_part(guess->T_prev_curr_body));
    motion.T_prev_curr_body = motion.T_prev_curr_body * (flat.inverse() * guess->T_prev_curr_body);
  }
  return motion;
}

}  // namespace lamina
