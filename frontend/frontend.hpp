// From measurements to what the mapper takes: one step for every scan and depth frame.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include <lamina/frontend/depth/depth_distortion.hpp>
#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/knock_watch.hpp>
#include <lamina/frontend/depth/mounting_check.hpp>
#include <lamina/frontend/depth/noise_watch.hpp>
#include <lamina/frontend/depth/optical_watch.hpp>
#include <lamina/frontend/depth/tilted_start.hpp>
#include <lamina/frontend/frontend_options.hpp>
#include <lamina/frontend/motion/depth_motion.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/motion/sweep_watch.hpp>
#include <lamina/frontend/motion/wheel_bias_filter.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/frontend/obstacles/coarse_depth.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/frontend/segments/mounting_correction.hpp>
#include <lamina/frontend/segments/range_check.hpp>
#include <lamina/frontend/segments/range_noise.hpp>
#include <lamina/frontend/segments/segment_frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/models/observation.hpp>
#include <lamina/models/skipped.hpp>
#include <lamina/sensors/measurement.hpp>

namespace lamina {

/// What one instant gave.
struct Step {
  Observations observations;
  Increment motion;          ///< of the body since the step before; identity for the first
  bool motion_known = true;  ///< false: nothing measured it (constant velocity was assumed)
  /// A scan with returns enough that does not fit the last ones wherever it is laid, or a scan or
  /// image that tells no motion (or not surely, after a long gap) where no wheels do: the robot was
  /// carried away, the world changed, or nothing was seen. Its motion is a guess.
  bool tracking_lost = false;
  /// An image, or a scan without wheels, told the motion, but not in all directions.
  bool open_direction = false;
  LeftToWheels left_to_wheels;            ///< where scans or images were asked, too
  bool by_image = false;                  ///< images alone told the motion
  bool slopes = false;                    ///< an image; of late the ground changed its slope
  SE3 T_start_body;                       ///< all motions so far, chained: dead reckoning
  std::optional<LaserScan> scan;          ///< straightened, for loop closing and the occupancy grid
  std::optional<ScanMotion> scan_motion;  ///< since the last scan, of level scanners
  std::optional<SE3> wheels_moved;        ///< the body since the last scan, as wheels have it
  /// Steps just before that lie in a hole of the odometry: this one's motion is what wheels counted
  /// across it.
  std::int64_t across_hole = 0;
  std::optional<ObstacleScan> obstacles;  ///< from depth: levelled frame of this instant
  SE3 T_body_levelled;                    ///< that frame in the body
  std::optional<GroundLook> ground;       ///< from depth, in that frame
  std::optional<DepthLook> sight;         ///< from depth, in the sensor's frame
};

/// T_map_body of a body that sees this floor: floor at z = 0, origin above (0, 0), x of the map
/// along the body's heading.
SE3 levelled_pose(const Plane& floor_body);

/// Whether the scanner's plane is the body's, to `max_tilt` (rad).
bool is_level(const SE3& T_body_lidar, double max_tilt);

/// Routes each measurement to its front-end and works out how the body moved since the last step:
/// wheels where there are any, refined by matching scans; scans or depth images alone otherwise.
/// Where wheels and scans stop and images go on, these tell the motion; where nothing does, it is
/// said to be unknown.
class FrontEnd {
 public:
  FrontEnd(const FrontEndOptions& options, const Calibration& calibration);

  /// nullopt for measurements that make no step of their own (odometry, accelerometer) or that
  /// could not be used (counted in skipped()). Stage times go to `metrics`.
  std::optional<Step> process(const Measurement& measurement, Diagnostics& metrics);
  /// What is taken out of every depth image from now on.
  void correct_depth(DepthDistortion distortion) { distortion_ = std::move(distortion); }
  /// The body stands tilted where the recording begins; before the first measurement.
  void begin_tilted(const TiltedStart& start);
  /// The depth camera sits otherwise than calibrated; before the first measurement.
  void begin_with_mounting(const SE3& T_body_camera_calibrated, const Leveling& mounting) {
    floor_.begin(T_body_camera_calibrated, mounting);
  }
  /// How a level scanner's mounting is wrong; before the first scan.
  void correct_level_scanner(const MountingCorrection& correction) { level_scanner_ = correction; }
  /// s, of scans that do not say; before the first scan.
  void set_sweep(double sweep) { sweep_ = sweep; }
  /// What watch_for_sweep() has found since the last call.
  std::optional<SweepFinder::Found> take_found_sweep() {
    return std::exchange(found_sweep_, std::nullopt);
  }
  /// Looks for it on the way: where no look over the whole recording came before (online).
  void watch_for_sweep() { sweep_watch_.emplace(); }
  /// Odometry of the whole recording, for the motion within scans alone; before the first scan.
  void use_whole_odometry(WheelTrack wheels) { wheels_ahead_ = std::move(wheels); }
  /// What is known of the wheels' scale; before the first measurement.
  void begin_wheels(double scale, double sigma) { learned_.begin(scale, sigma); }
  /// Wheels that contradict the scans and themselves: as if there were none; before the first
  /// measurement.
  void leave_wheels() { without_wheels_ = true; }
  /// A first look by scans alone, which know what `other` was told of scanners: along a corridor,
  /// too, they tell the way as well as they can.
  void look_by_scans(const FrontEnd& other);
  /// Lets the body tilt where the ground does: where no image motions come later (offline) to say.
  void follow_slopes() { follow_slopes_ = true; }
  /// Lets images tell motions beside wheels where there is no scanner: where no second look comes
  /// later (offline) that does.
  void ask_images_beside_wheels() { images_beside_wheels_ = true; }
  const DepthDistortion& depth_distortion() const { return distortion_; }
  /// True where the floor of the first image gave the first pose: the map's level is as good as
  /// that image's, and the refined floor knows better.
  bool levelled_by_image() const { return levelled_by_image_; }
  /// There was odometry, but never at the time of a scan or frame: it told nothing.
  bool odometry_never_met() const { return !wheels_.empty() && !wheels_met_; }
  /// There was odometry that stayed where it began.
  bool odometry_never_moved() const { return wheels_met_ && !wheels_.moved(); }
  /// Wheels on a floor told motions of frames or scans.
  bool met_wheels() const { return wheels_met_ && planar_; }
  /// Odometry of any kind told motions of frames or scans.
  bool met_odometry() const { return wheels_met_; }
  /// Lawful errors that the wheels may have still (scale, drift, turn scale), 1-sigma.
  Eigen::Vector3d wheel_errors_left() const { return learned_.left(); }
  /// m, 1-sigma: how far the scanner's ranges scattered at most; 0 where no more than stated.
  double scanner_noise() const { return scanner_noise_; }
  /// Images in which the ground changes its slope.
  std::int64_t slopes_seen() const { return slopes_seen_; }
  /// How far ranges of scans scatter, against what is stated.
  const RangeNoise& range_noise() const { return range_noise_; }
  /// What is claimed of the scanner's largest range, likewise.
  const RangeCheck& range_check() const { return range_check_; }
  /// How noisy depth images are, against what their calibration says.
  const NoiseWatch& depth_noise() const { return depth_noise_; }
  /// How many of them show floor where their mounting says.
  const FloorsAsStated& floors_as_stated() const { return floors_; }
  /// Where they show floor, if their calibration turns nothing.
  const OpticalWatch& optical() const { return optical_; }
  /// Measurements that were left out, by reason.
  SkippedCounts skipped() const;
  /// For archives (models/archive.hpp): all that one measurement leaves to the next.
  template <class A>
  friend void fields(A& a, FrontEnd& v) {
    // All members by name: one more, and this no longer compiles until it is decided here.
    auto& [distortion, T_level_start, level_scanner, planar, depth_seen, first_step,
           first_floor_map, levelled_by_image, wheels, wheels_ahead, learned, met, floor, obstacles,
           images, segments, scan_odometry, max_tilt, sweep, T_start_body, last_step, last_observed,
           last_scan, T_start_scan_body, since_scan, scan_step, scan_interval, last_image,
           T_start_image, image_velocity, skipped, ground_returns, last_slope, last_two_slopes,
           slopes_seen, knocks, last_sight, since_image, lifted_since_scan, ever_lifted,
           follow_slopes, images_beside_wheels, sweep_watch, scans_tell_scale, scan_left,
           range_noise, scanner_noise, depth_noise, optical, floors, range_check, met_last,
           without_wheels, found_sweep] = v;
    static_cast<void>(found_sweep);           // taken before the next measurement
    static_cast<void>(follow_slopes);         // of the mode
    static_cast<void>(images_beside_wheels);  // likewise
    static_cast<void>(distortion);            // of the recording, before it is mapped
    static_cast<void>(T_level_start);         // likewise
    static_cast<void>(level_scanner);         // likewise
    static_cast<void>(planar);                // of the calibration
    static_cast<void>(max_tilt);              // of the settings
    static_cast<void>(wheels_ahead);          // of the recording, before it is mapped
    static_cast<void>(scans_tell_scale);      // of such a look
    static_cast<void>(obstacles);             // keeps buffers alone
    static_cast<void>(without_wheels);        // of the recording, before it is mapped
    a(depth_seen, first_step, first_floor_map, levelled_by_image, wheels, learned, met, images,
      segments, scan_odometry, T_start_body, last_step, last_observed, last_scan, T_start_scan_body,
      since_scan, scan_step, scan_interval, last_image, T_start_image, skipped, ground_returns,
      last_slope, last_two_slopes, slopes_seen, knocks, last_sight, since_image, lifted_since_scan,
      ever_lifted, sweep, sweep_watch, scan_left, range_noise, scanner_noise, depth_noise, optical,
      floors, range_check, met_last);
    if constexpr (A::kReading) {
      floor.load(a);
    } else {
      floor.save(a);
    }
  }

 private:
  double sweep_of(const LaserScan& scan) const;
  std::optional<Vector6d> wheels_in(const LaserScan& scan, double sweep) const;
  std::optional<Vector6d> last_velocity() const;
  std::optional<Vector6d> other_velocity(double dt, double sweep, const ScanMotion& motion,
                                         const std::optional<Vector6d>& used) const;
  void watch_sweep(const LaserScan& measured, const std::optional<Increment>& wheels,
                   const ScanMotion& motion, Diagnostics& metrics);
  LaserScan prepared(const LaserScan& measured, bool level, double sweep,
                     const std::optional<Vector6d>& velocity, std::int64_t& ground) const;
  LaserScan as_noisy_as_it_is(const LaserScan& measured);
  std::optional<Step> process_scan(const LaserScan& measured, Diagnostics& metrics);
  struct ScanOnItsWay;
  ScanOnItsWay on_its_way(const LaserScan& measured) const;
  std::optional<MotionGuess> guess(Timestamp stamp, const std::optional<Increment>& wheels,
                                   Step& step) const;
  /// Straightens the scan by its own motion where wheels did not tell it.
  ScanMotion match(ScanOnItsWay& way, const std::optional<MotionGuess>& guess,
                   Diagnostics& metrics);
  /// Where the match says nothing, or what it says is no motion.
  void check_match(const ScanOnItsWay& way, bool guessed, ScanMotion& motion, Step& step);
  void remember(const ScanOnItsWay& way, const ScanMotion& motion, const SE3& T_start_body,
                Step& step);
  std::optional<Step> process_depth(const DepthFrame& frame, SensorKind kind, Diagnostics& metrics);
  void begin_scans(Timestamp stamp, Step& step, ScanMotion& motion);
  bool lost(const ScanMotion& motion, bool guessed) const;
  ScanMotion move_by_scan(const LaserScan& scan, const std::optional<MotionGuess>& guess,
                          bool level);
  std::optional<Step> process_cloud(const CloudFrame& cloud, Diagnostics& metrics);
  /// The step's motion and pose, and what the floor front-end says brought to the body's frame.
  void place(Step& step, const FloorResult& floor, const Increment& moved);
  /// The motion since the last depth frame by the images alone; the first: T_map_body.
  Increment move_by_depth(const DepthFrame& frame, const FloorResult& floor, Step& step,
                          Diagnostics& metrics);
  /// The motion since the last step where wheels say nothing and scans have come before.
  Increment bridge(const DepthFrame& frame, Step& step, Diagnostics& metrics);
  /// The motion since the last step, which wheels measured, by the image and them.
  Increment beside_wheels(const DepthFrame& frame, Step& step, const Increment& wheels,
                          Diagnostics& metrics);
  /// coast(), with what the step must say of it.
  Increment coasted(Timestamp stamp, Step& step) const;
  bool scanned_of_late(Timestamp stamp) const;
  std::optional<MotionGuess> bridged_since_scan() const;
  /// Chains the pose on and gives the increment since the last step.
  Increment advance(const SE3& T_start_body, const Matrix6d& covariance, Timestamp stamp);
  SE3 dead_reckoned(Timestamp stamp) const;
  Increment coast(Timestamp stamp) const;
  Eigen::Vector3d up_map() const;
  std::optional<Plane> first_floor_map();
  Matrix6d held_level(Matrix6d covariance) const;
  Matrix6d held_to_floor(Matrix6d covariance) const;
  void look_for_slopes(const FloorResult& floor);
  bool slopes_of_late(Timestamp stamp) const;
  bool may_be_knocked(Timestamp stamp);
  void keep_slopes_in_mind(Timestamp stamp, const Increment& moved);
  static Increment tilting(Increment increment);
  /// What `moved` lacks where the ground changes its slope, by the image.
  Increment off_plane(const DepthFrame& frame, const Step& step, const Increment& moved,
                      Diagnostics& metrics);
  void point_up(Step& step);
  bool meet(Timestamp stamp);
  std::optional<Increment> measured_way(const std::optional<Timestamp>& from, Timestamp to) const;
  std::optional<Increment> without_systematic_errors(
      const std::optional<Increment>& measured) const;
  Matrix6d of_unknown_scale(const Increment& wheels) const;
  std::optional<Increment> driven(const std::optional<Timestamp>& from, Timestamp to) const;
  std::optional<Increment> across_hole(const SE3& T_start_from, Timestamp to) const;
  void note_met(Timestamp stamp, const Increment& increment);

  DepthDistortion distortion_;            // taken out of depth images
  std::optional<SE3> T_level_start_;      // how the body stands at first, where it is tilted
  MountingCorrection level_scanner_;      // how level scanners' mounting is wrong
  bool planar_;                           // the robot stands on a floor
  bool depth_seen_ = false;               // and something sees that floor
  std::optional<SE3> first_step_;         // T_map_body
  std::optional<Plane> first_floor_map_;  // under it, where that is known
  bool levelled_by_image_ = false;
  WheelTrack wheels_, wheels_ahead_;
  WheelLearning learned_;    // of their lawful errors
  bool wheels_met_ = false;  // they said something of a frame's or scan's own time
  FloorFrontend floor_;
  ObstacleScanner obstacles_;
  ImageTrack images_;
  SegmentFrontend segments_;
  ScanOdometry scan_odometry_;
  double max_tilt_;   // rad between scanner and body plane: beyond, scans are not matched
  double sweep_;      // s, of a scan that does not say: as set, or found on the way
  SE3 T_start_body_;  // the chain of increments handed out so far
  std::optional<Timestamp> last_step_, last_observed_;  // the latter: whose motion was measured
  std::optional<Timestamp> last_scan_;
  SE3 T_start_scan_body_;               // the chain at the last scan
  std::optional<Matrix6d> since_scan_;  // covariance of the way from there, where images came
  SE3 scan_step_;                       // the last motion between two scans,
  double scan_interval_ = 0;            // and the time between them, s
  std::optional<Timestamp> last_image_;
  SE3 T_start_image_;                       // the chain at the last image
  std::optional<Vector6d> image_velocity_;  // of the body up to it: right tangent a second
  SkippedCounts skipped_;
  std::int64_t ground_returns_ = 0;           // taken out of scans
  std::optional<Timestamp> last_slope_;       // when a camera last saw the ground change its slope
  std::optional<Timestamp> last_two_slopes_;  // likewise, two of them in one image
  std::int64_t slopes_seen_ = 0;
  KnockWatch knocks_;
  std::optional<Timestamp> last_sight_;      // of the last image whose look was kept
  Matrix6d since_image_ = Matrix6d::Zero();  // covariance of the way from the last image
  std::optional<SE3> lifted_since_scan_;     // what images added to what lies in the plane
  bool ever_lifted_ = false;
  bool follow_slopes_ = false;
  bool images_beside_wheels_ = false;
  std::optional<SweepWatch> sweep_watch_;
  bool scans_tell_scale_ = false;
  LeftToWheels scan_left_;  // by the last scan, and as likely between it and the next
  RangeNoise range_noise_;
  double scanner_noise_ = 0;  // m, at most, where it is more than stated
  NoiseWatch depth_noise_;
  OpticalWatch optical_;
  FloorsAsStated floors_;
  RangeCheck range_check_;
  /// The last step at which wheels said where they are, and the way since, which they did not see.
  struct Met {
    Timestamp stamp;
    SE3 T_start_body;
    Matrix6d since = Matrix6d::Zero();  // covariance, right tangent
    std::int64_t steps = 0;
    template <class A>
    friend void fields(A& a, Met& v) {
      a(v.stamp, v.T_start_body, v.since, v.steps);
    }
  };
  std::optional<Met> met_last_;
  bool without_wheels_ = false;
  std::optional<SweepFinder::Found> found_sweep_;
};

}  // namespace lamina
