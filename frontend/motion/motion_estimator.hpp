// How the body moves from step to step: by wheels, scans and images, whatever there is of them.
#pragma once

#include <cstdint>
#include <optional>

#include <lamina/frontend/motion/depth_motion.hpp>
#include <lamina/frontend/motion/motion_options.hpp>
#include <lamina/frontend/motion/scan_duration.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/motion/slope_watch.hpp>
#include <lamina/frontend/motion/step.hpp>
#include <lamina/frontend/motion/wheel_motion.hpp>
#include <lamina/frontend/segments/mounting_correction.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/sensors/measurement.hpp>

namespace lamina {

/// A scan as of one instant, and how the body came to it.
struct MatchedScan {
  LaserScan scan;                   ///< straightened, without returns from the ground
  bool level = false;               ///< its plane is the body's
  ScanMotion motion;                ///< since the last scan
  std::optional<SE3> moved;         ///< the same; nullopt for the first scan
  std::optional<Increment> wheels;  ///< since the last scan, as they measured
  bool guessed = false;             ///< wheels or images told the way before it was matched
  bool wants_walls = true;          ///< false: nothing asks what it shows
  /// Every line of a scanner that is not level contradicts the odometry; by how much it leapt
  /// (scanner's tangent), where that is known.
  bool contradicted = false;
  std::optional<Vector6d> leap;
};

/// Wheels where there are any, refined by matching scans; scans or depth images alone otherwise.
/// Where wheels and scans stop and images go on, these tell the motion; where nothing does, it is
/// said to be unknown. Every step: begin(), then match() and accept() for a scan, by_wheels() and
/// move() for an image or cloud.
class MotionEstimator {
 public:
  MotionEstimator(const MotionOptions& options, const Calibration& calibration);

  /// How the body stands where the recording begins; before the first measurement.
  void begin_tilted(const SE3& T_level_body) { T_level_start_ = T_level_body; }
  /// How a level scanner's mounting is wrong; before the first scan.
  void correct_level_scanner(const MountingCorrection& correction) { level_scanner_ = correction; }
  /// Lets the body tilt where the ground does: where no image motions come later (offline) to say.
  void follow_slopes() { follow_slopes_ = true; }
  /// Lets images tell motions beside wheels where there is no scanner: where no second look comes
  /// later (offline) that does.
  void ask_images_beside_wheels() { images_beside_wheels_ = true; }
  /// A first look by scans alone, which know what `other` was told of scanners: along a corridor,
  /// too, they tell the way as well as they can.
  void look_by_scans(const MotionEstimator& other);
  WheelMotion& wheels() { return wheels_; }
  const WheelMotion& wheels() const { return wheels_; }
  ScanDuration& scan_duration() { return duration_; }

  /// False where the stamp goes back: there is no step then.
  bool begin(Timestamp stamp);
  /// The scan straightened and matched; where wheels do not tell the motion within it, by its own.
  MatchedScan match(const LaserScan& measured, Diagnostics& diagnostics);
  /// The step to a scan once it is known what its lines say.
  void accept(const MatchedScan& matched, Step& step);
  /// The way to an image or cloud by wheels alone; nullopt where they do not tell it.
  std::optional<Increment> by_wheels(Timestamp stamp, Step& step) const;
  /// The step to an image, which wheels may have told of.
  void move(const DepthFrame& frame, const FloorResult& floor, std::optional<Increment> moved,
            Step& step, Diagnostics& diagnostics);
  /// Clouds say what planes there are; how the body moved is the wheels' or scans' to say.
  void move(const CloudFrame& cloud, const FloorResult& floor, std::optional<Increment> moved,
            Step& step);

  /// All motions so far, chained.
  const SE3& T_start_body() const { return T_start_body_; }
  /// The floor under a body that stands on it, in the map's frame; nullopt: not known yet, or none.
  std::optional<Plane> first_floor_map();
  /// It was begun tilted and has not driven off that place yet.
  bool at_tilted_start() const;
  const SlopeWatch& slopes() const { return slopes_; }
  /// The floor of the first image gave the first pose: the map's level is as good as that image's,
  /// and the refined floor knows better.
  bool levelled_by_image() const { return levelled_by_image_; }

  /// For archives (models/archive.hpp): all that one measurement leaves to the next.
  template <class A>
  friend void fields(A& a, MotionEstimator& v) {
    // All members by name: one more, and this no longer compiles until it is decided here.
    auto& [planar, max_tilt, T_level_start, level_scanner, follow_slopes, images_beside_wheels,
           scans_tell_scale, wheels, duration, scan_odometry, images, slopes, T_start_body,
           first_step, last_step, last_observed, first_floor_map, ground_seen, levelled_by_image,
           ever_lifted, ground_returns, scan, image] = v;
    static_cast<void>(planar);                // of the calibration
    static_cast<void>(max_tilt);              // of the settings
    static_cast<void>(T_level_start);         // of the recording, before it is mapped
    static_cast<void>(level_scanner);         // likewise
    static_cast<void>(follow_slopes);         // of the mode
    static_cast<void>(images_beside_wheels);  // likewise
    static_cast<void>(scans_tell_scale);      // of a first look
    a(wheels, duration, scan_odometry, images, slopes, T_start_body, first_step, last_step,
      last_observed, first_floor_map, ground_seen, levelled_by_image, ever_lifted, ground_returns,
      scan, image);
  }

 private:
  // The last scan, and the way since.
  struct LastScan {
    std::optional<Timestamp> stamp;
    SE3 T_start_body;               // the chain there
    SE3 moved;                      // the last motion between two scans,
    double interval = 0;            // and the time between them, s
    LeftToWheels left_to_wheels;    // by the last scan, and as likely between it and the next
    std::optional<Matrix6d> since;  // covariance of the way from there, where images came
    std::optional<SE3> lifted;      // what images added to what lies in the plane
    template <class A>
    friend void fields(A& a, LastScan& v) {
      auto& [stamp, T_start_body, moved, interval, left_to_wheels, since, lifted] = v;
      a(stamp, T_start_body, moved, interval, left_to_wheels, since, lifted);
    }
  };
  // The last image, and the way since.
  struct LastImage {
    std::optional<Timestamp> stamp;
    SE3 T_start_body;                   // the chain there
    std::optional<Vector6d> velocity;   // of the body up to it: right tangent a second
    Matrix6d since = Matrix6d::Zero();  // covariance of the way from there
    template <class A>
    friend void fields(A& a, LastImage& v) {
      auto& [stamp, T_start_body, velocity, since] = v;
      a(stamp, T_start_body, velocity, since);
    }
  };
  struct Straightening;  // of one scan

  // By scans (motion_estimator_scans.cpp).
  Straightening straighten(const LaserScan& measured) const;
  void straighten_by(const std::optional<Vector6d>& velocity, Straightening& scan) const;
  std::optional<MotionGuess> guess(Timestamp stamp, const std::optional<Increment>& wheels) const;
  ScanMotion match(Straightening& scan, const std::optional<MotionGuess>& guess,
                   Diagnostics& diagnostics);
  ScanMotion move_by_scan(const LaserScan& scan, const std::optional<MotionGuess>& guess,
                          bool level);
  std::optional<Vector6d> last_scan_velocity() const;
  void watch_duration(const LaserScan& measured, const std::optional<Increment>& wheels,
                      const ScanMotion& motion, Diagnostics& diagnostics);
  void begin_scans(Timestamp stamp, Step& step, ScanMotion& motion);
  bool carried_away_by(const ScanMotion& motion, bool guessed) const;
  void check_match(const MatchedScan& matched, ScanMotion& motion, Step& step) const;
  void remember(const MatchedScan& matched, const ScanMotion& motion, Step& step);
  bool scanned_of_late(Timestamp stamp) const;
  std::optional<MotionGuess> bridged_since_scan() const;

  // By images (motion_estimator_images.cpp).
  Increment by_images_alone(const DepthFrame& frame, const FloorResult& floor, Step& step);
  Increment bridge(const DepthFrame& frame, Step& step);
  Increment beside_wheels(const DepthFrame& frame, Step& step, const Increment& wheels);
  Increment off_plane(const DepthFrame& frame, const Step& step, const Increment& moved);
  void keep_slopes_in_mind(Timestamp stamp, const Increment& moved);

  // By wheels, or by nothing.
  std::optional<Increment> measured_by_wheels(const std::optional<Timestamp>& from,
                                              Timestamp to) const;
  SE3 dead_reckoned(Timestamp stamp) const;
  Increment coast(Timestamp stamp) const;
  Increment coasted(Timestamp stamp, Step& step) const;
  Matrix6d held_level(Matrix6d covariance) const;
  Matrix6d held_to_floor(Matrix6d covariance) const;

  // The chain.
  void place(Timestamp stamp, const Increment& moved, Step& step);
  Increment advance(const SE3& T_start_body, const Matrix6d& covariance, Timestamp stamp);
  Eigen::Vector3d up_map() const;
  void point_up(Step& step);

  bool planar_;      // the robot stands on a floor
  double max_tilt_;  // rad between scanner and body plane: beyond, scans are not matched
  std::optional<SE3> T_level_start_;  // how the body stands at first, where it is tilted
  MountingCorrection level_scanner_;
  bool follow_slopes_ = false, images_beside_wheels_ = false, scans_tell_scale_ = false;
  WheelMotion wheels_;
  ScanDuration duration_;
  ScanOdometry scan_odometry_;
  ImageTrack images_;
  SlopeWatch slopes_;
  SE3 T_start_body_;                                    // the increments handed out so far
  std::optional<SE3> first_step_;                       // T_map_body
  std::optional<Timestamp> last_step_, last_observed_;  // the latter: whose motion was measured
  std::optional<Plane> first_floor_map_;
  bool ground_seen_ = false;  // by a camera
  bool levelled_by_image_ = false, ever_lifted_ = false;
  std::int64_t ground_returns_ = 0;  // taken out of scans
  LastScan scan_;
  LastImage image_;
};

}  // namespace lamina
