// Routing and dead reckoning.
#include <lamina/apps/front_end.hpp>

#include <algorithm>
#include <utility>

#include <lamina/apps/unknown_motion.hpp>

namespace lamina::apps {
namespace {

constexpr int kRounds = 3;  // of straightening a scan by its own motion

// Tracks are predicted with the wheels' own uncertainty.
TrackingOptions tracking_of(const Settings& settings, const Calibration& calibration) {
  TrackingOptions tracking = settings.tracking;
  tracking.odometry = calibration.odometry;
  return tracking;
}

// The floor tells how a camera is mounted on a body that stands on it. One that flies or is carried
// tilts: what tilts with it is no mounting.
FloorOptions floor_options(const Settings& settings, bool planar) {
  FloorOptions options = settings.floor;
  options.self_calibrate = options.self_calibrate && planar;
  return options;
}

}  // namespace

SE3 levelled_pose(const Plane& floor_body) {
  const SO3 level(
      Eigen::Quaterniond::FromTwoVectors(floor_body.normal(), Eigen::Vector3d::UnitZ()));
  const SO3 R = SO3::rot_z(-level.yaw()) * level;
  return SE3(R, {0, 0, -floor_body.rho()});
}

namespace {

// A scan that fits nowhere while the wheels go on (the robot tipped) is no view of the place.
bool shows_nothing(const ScanMotion& motion) {
  const bool told = motion.status != ScanMotion::Status::kFirst &&
                    (motion.status != ScanMotion::Status::kPredicted || motion.wheels_went_on);
  return told && motion.iterations == 0;
}

// Images contradict wheels that slip; beside them scans gain nothing by a kernel over the wheels.
ScanOdometryOptions scan_odometry_of(const Settings& settings, const Calibration& calibration) {
  ScanOdometryOptions options = settings.scan_odometry;
  options.robust_wheels = !calibration.depth_camera && !calibration.stereo_camera;
  return options;
}

}  // namespace

FrontEnd::FrontEnd(const Settings& settings, const Calibration& calibration)
    : planar_(calibration.odometry.planar),
      wheels_(calibration.odometry),
      wheels_ahead_(calibration.odometry),
      learned_(settings.calibrate_wheels),
      floor_(floor_options(settings, planar_)),
      obstacles_(scan_options(settings)),
      segments_(settings.segments, tracking_of(settings, calibration)),
      scan_odometry_(scan_odometry_of(settings, calibration)),
      max_tilt_(settings.scan_odometry.max_tilt),
      sweep_(settings.sweep) {}

void FrontEnd::begin_tilted(const TiltedStart& start) {
  floor_.begin(start.T_body_camera, start.usual);
  T_level_start_ = start.T_level_body();
}

std::optional<Step> FrontEnd::process(const Measurement& measurement, io::Metrics& metrics) {
  if (const auto* odometry = std::get_if<Odometry>(&measurement)) {
    if (!without_wheels_) wheels_.add(*odometry);
    return std::nullopt;
  }
  if (const auto* scan = std::get_if<LaserScan>(&measurement)) {
    return process_scan(as_noisy_as_it_is(*scan), metrics);
  }
  if (const auto* depth = std::get_if<DepthFrame>(&measurement)) {
    if (distortion_.empty()) return process_depth(*depth, SensorKind::kDepth, metrics);
    DepthFrame frame = *depth;
    distortion_.correct(frame);
    return process_depth(frame, SensorKind::kDepth, metrics);
  }
  if (const auto* pair = std::get_if<StereoFrame>(&measurement)) {
    const DepthFrame frame = [&] {
      const auto timer = metrics.time("stereo");
      return depth_from_stereo(*pair);
    }();
    return process_depth(frame, SensorKind::kStereo, metrics);
  }
  if (const auto* cloud = std::get_if<CloudFrame>(&measurement)) {
    return process_cloud(*cloud, metrics);
  }
  return std::nullopt;
}

// False where the stamp goes back. Odometry that ends before the first frame, or begins after the
// last, is none.
bool FrontEnd::meet(Timestamp stamp) {
  if (last_step_ && stamp < *last_step_) {
    ++skipped_["stamp goes back"];
    return false;
  }
  wheels_met_ = wheels_met_ || wheels_.at(stamp).has_value();
  // A scan asks back to the last scan, an image to the last step.
  auto from = last_scan_ ? last_scan_ : last_step_;
  if (from && met_last_) from = std::min(*from, met_last_->stamp);
  if (from) wheels_.forget_before(*from);
  return true;
}

// Where up is at the start: along the body, unless that is known to stand tilted.
Eigen::Vector3d FrontEnd::up_map() const {
  const SO3& R = first_step_->so3();
  return (T_level_start_ ? R * T_level_start_->so3().inverse() : R) * Eigen::Vector3d::UnitZ();
}

// A body on wheels stands on it; one whose scanner is all that tells its motion is taken to move
// level, too. A single image that gave the first pose is not good enough.
std::optional<Plane> FrontEnd::first_floor_map() {
  if (!first_floor_map_ && first_step_ && (wheels_met_ ? planar_ : last_scan_.has_value())) {
    const SE3 T_map_start =
        T_level_start_ ? *first_step_ * T_level_start_->inverse() : *first_step_;
    first_floor_map_ = Plane(up_map(), up_map().dot(T_map_start.translation()));
  }
  return first_floor_map_;
}

// Wheels on a floor that no camera sees: a level scanner cannot tell height, roll and pitch, and
// over thousands of steps even a small freedom in them is used up by wrong matches.
Matrix6d FrontEnd::held_level(Matrix6d covariance) const {
  if (!planar_ || depth_seen_) return covariance;
  constexpr double kHeight = 1e-4, kLevel = 1e-5;  // m and rad a step
  for (const int k : {2, 3, 4}) {
    covariance.row(k).setZero();
    covariance.col(k).setZero();
    const double sigma = k == 2 ? kHeight : kLevel;
    covariance(k, k) = sigma * sigma;
  }
  return covariance;
}

Increment FrontEnd::advance(const SE3& T_start_body, const Matrix6d& covariance, Timestamp stamp) {
  Increment increment{T_start_body_.inverse() * T_start_body, covariance};
  if (follow_slopes_ && slopes_of_late(stamp) && !last_scan_) increment = tilting(increment);
  const Matrix6d J = increment.T_from_to.inverse().adjoint();
  since_image_ = J * since_image_ * J.transpose() + increment.covariance;
  T_start_body_ = T_start_body;
  if (!first_step_) first_step_ = T_start_body;
  last_step_ = stamp;
  if (!last_told_) last_told_ = stamp;
  note_met(stamp, increment);
  return increment;
}

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
  if (const auto moved = less_lawful_errors(wheels)) {
    step.wheels_moved = wheels->T_from_to;
    return MotionGuess{moved->T_from_to,
                       scans_tell_scale_ ? of_unknown_scale(*moved) : moved->covariance};
  }
  if (const auto gap = across_hole(T_start_scan_body_, stamp); gap && last_scan_)
    return MotionGuess{gap->T_from_to, gap->covariance - met_last_->since};
  return scanned_of_late(stamp) ? std::nullopt : bridged_since_scan();
}

ScanMotion FrontEnd::match(ScanOnItsWay& way, const std::optional<MotionGuess>& guess,
                           io::Metrics& metrics) {
  const auto timer = metrics.time("odometry");
  if (!way.by_itself) return move_by_scan(way.scan, guess, way.level);
  const ScanOdometry before = scan_odometry_;
  ScanMotion motion = move_by_scan(way.scan, guess, way.level);
  for (int round = 0; round < kRounds; ++round) {
    const auto other =
        told_otherwise(way.scan.stamp - *last_scan_, way.sweep, motion, way.velocity);
    if (!other) break;
    way.velocity = other;
    way.scan = prepared(way.measured, way.level, way.sweep, way.velocity, way.ground);
    scan_odometry_ = before;
    motion = move_by_scan(way.scan, guess, way.level);
  }
  return motion;
}

void FrontEnd::doubt(const ScanOnItsWay& way, bool guessed, ScanMotion& motion, Step& step) {
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

std::optional<Step> FrontEnd::process_scan(const LaserScan& measured, io::Metrics& metrics) {
  if (!meet(measured.stamp)) return std::nullopt;
  ScanOnItsWay way = on_its_way(measured);
  Step step;
  const std::optional<Increment> wheels = measured_way(last_scan_, measured.stamp);
  const std::optional<MotionGuess> guess = this->guess(measured.stamp, wheels, step);
  ScanMotion motion = match(way, guess, metrics);
  if (way.level && shows_nothing(motion)) {
    metrics.counts["scans_left_out"] += 1;
    std::fill(way.scan.ranges.begin(), way.scan.ranges.end(), HUGE_VALF);
  }
  if (way.level) watch_sweep(measured, wheels, motion, metrics);
  if (way.level && planar_)
    metrics.counts["ground_returns"] = static_cast<double>(ground_returns_ += way.ground);
  // Of a level scanner's first look over wheels, nobody asks for walls.
  if (!(scans_tell_scale_ && way.level)) {
    const auto timer = metrics.time("segments");
    step.observations = segments_.process(
        way.scan, last_scan_ ? std::optional<SE3>(motion.T_prev_curr_body) : std::nullopt);
  }
  if (!last_scan_) begin_scans(measured.stamp, step, motion);
  SE3 T_start_body = T_start_scan_body_ * motion.T_prev_curr_body;
  if (lifted_since_scan_) T_start_body = T_start_body * *lifted_since_scan_;
  doubt(way, guess.has_value(), motion, step);
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
  if (step.motion_known && !step.tracking_lost) last_told_ = way.scan.stamp;
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

std::optional<Step> FrontEnd::process_depth(const DepthFrame& frame, SensorKind kind,
                                            io::Metrics& metrics) {
  if (!meet(frame.stamp)) return std::nullopt;
  depth_seen_ = true;
  Step step;
  std::optional<Increment> moved = driven(last_step_, frame.stamp);
  if (!moved && (moved = across_hole(T_start_body_, frame.stamp))) {
    step.across_hole = met_last_->steps;
  }
  if (moved && scanned_of_late(frame.stamp)) step.left_to_wheels = scan_left_;
  FloorResult floor;
  {
    const auto timer = metrics.time("floor");
    floor_.believe_knocks(may_be_knocked(frame.stamp));
    floor = floor_.process(frame);
    floor.sensor = kind;
    floors_.add(frame, floor);
    optical_.add(floor, frame.camera.camera.T_body_camera);
    const bool ideal = frame.camera.noise.kind == DepthNoise::Kind::kIdeal;
    depth_noise_.add(floor.noise_scale / (ideal ? raised_by_rounding(frame) : 1));
    metrics.counts["depth_noise_over_calibration"] = depth_noise_.median();
    look_for_slopes(floor);
    step.observations = floor.to_observations();
  }
  {
    const auto timer = metrics.time("obstacles");
    step.obstacles = obstacles_.process(frame, floor, floor_.disparities());
  }
  if (!floor.look.empty()) step.ground = std::move(floor.look);
  if (!last_sight_ || frame.stamp - *last_sight_ >= kLookInterval) {
    if (DepthLook look = depth_look(frame); !look.empty()) {
      step.sight = std::move(look);
      last_sight_ = frame.stamp;
    }
  }
  if (!wheels_met_ && !last_scan_) {
    moved = move_by_depth(frame, floor, step, metrics);
  } else if (!moved) {
    moved = bridge(frame, step, metrics);
  } else if (images_beside_wheels_ && !last_scan_) {
    moved = beside_wheels(frame, step, *moved, metrics);
  }
  keep_slopes_in_mind(frame.stamp, *moved);
  place(step, floor, off_plane(frame, step, *moved, metrics));
  point_up(step);
  step.slopes = slopes_of_late(frame.stamp);
  last_image_ = frame.stamp;
  T_start_image_ = T_start_body_;
  since_image_.setZero();
  return step;
}

void FrontEnd::place(Step& step, const FloorResult& floor, const Increment& moved) {
  if (step.motion_known && !step.tracking_lost) {
    last_told_ = floor.stamp;
    const double dt = last_step_ ? floor.stamp - *last_step_ : 0;
    if (dt > 0) image_velocity_ = moved.T_from_to.log() / dt;
  }
  if (last_scan_) {
    const Matrix6d J = moved.T_from_to.inverse().adjoint();
    const Matrix6d before = since_scan_.value_or(Matrix6d::Zero());
    since_scan_ = J * before * J.transpose() + moved.covariance;
  }
  step.motion = advance(T_start_body_ * moved.T_from_to, moved.covariance, floor.stamp);
  step.T_start_body = T_start_body_;
  step.observations.first_floor_map = first_floor_map();
  // What the floor front-end says in the frame levelled by this image's floor, in that of the body.
  step.T_body_levelled = step.observations.T_body_sensor * floor.T_body_camera.inverse();
  for (Surfel& surfel : step.observations.surfels_body) {
    surfel = surfel.transformed(step.T_body_levelled);
  }
  for (Eigen::Vector3d& point : step.observations.obstacle_points_body) {
    point = step.T_body_levelled * point;
  }
}

// Clouds say what planes there are; how the body moved is the wheels' or scans' to say.
std::optional<Step> FrontEnd::process_cloud(const CloudFrame& cloud, io::Metrics& metrics) {
  if (cloud.points_sensor.empty()) {
    ++skipped_["cloud without points"];
    return std::nullopt;
  }
  if (!meet(cloud.stamp)) return std::nullopt;
  depth_seen_ = true;
  Step step;
  std::optional<Increment> moved = driven(last_step_, cloud.stamp);
  if (moved && scanned_of_late(cloud.stamp)) step.left_to_wheels = scan_left_;
  const auto timer = metrics.time("floor");
  const FloorResult floor = floor_.process(cloud);
  step.observations = floor.to_observations();
  if (!moved) moved = coasted(cloud.stamp, step);
  if (!last_step_ && !wheels_met_ && floor.floor_camera) {
    levelled_by_image_ = true;
    moved->T_from_to = levelled_pose(cloud.T_body_sensor * *floor.floor_camera);
  }
  place(step, floor, *moved);
  return step;
}

std::map<std::string, std::int64_t> FrontEnd::skipped() const {
  std::map<std::string, std::int64_t> all = skipped_;
  for (const auto& [why, count] : segments_.skipped()) all["scan: " + why] += count;
  return all;
}

}  // namespace lamina::apps
