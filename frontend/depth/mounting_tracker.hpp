// The sensor's mounting, followed over time: pitch, roll and height against calibration.
#pragma once

#include <deque>
#include <optional>

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/floor_result.hpp>
#include <lamina/frontend/depth/leveling.hpp>

namespace lamina {

/// A Kalman filter on (roll, pitch, height) with a slow random walk. Unevenness of the ground is
/// part of the measurement noise: its variance is what innovations scatter by beyond their own, and
/// their correlation from one to the next says how many independent places were seen. Slopes that
/// face the camera fill more of an image than those that fall away, so a share of the unevenness
/// (`facing_share`) never averages out. The published
/// mounting is the calibrated one until the estimate contradicts it
/// (`mounting_gate`). A measurement beyond four sigmas is set aside; when `confirm_frames` of them
/// in a row agree in a turn about the camera's own place (to 1 cm: ground that rises or falls ahead
/// passes the body at another height), the mounting was knocked and the state starts anew there.
/// Where those set aside tilt each in another way they are unevenness too; more of it than ground
/// has (`max_unevenness_deg`) is a camera that is not rigidly mounted (`rigid` false).
class MountingTracker {
 public:
  explicit MountingTracker(const FloorOptions& options);

  /// The mounting as more than one frame knows it, to some tenths of a degree: where to begin.
  void begin(const SE3& T_body_camera_calibrated, const Leveling& mounting);
  /// How uneven the ground of this recording is (1-sigma), where other frames showed it; before the
  /// first frame. Ground is never taken as more level than one place usually is.
  void expect_ground(const Leveling& sigma);
  /// Takes one frame's floor. `covariance` of its plane in Plane's tangent (tilt, tilt, rho).
  void update(const SE3& T_body_camera_calibrated, const Plane& floor_camera,
              const Eigen::Matrix3d& covariance);
  /// Whether a floor that is off for long may be a knocked camera (it may, unless told otherwise):
  /// not where the ground slopes.
  void accept_knocks(bool accepted) { knocks_accepted_ = accepted; }
  /// A frame without a floor: nothing changes, `changed` is cleared.
  void skip(const SE3& T_body_camera_calibrated);
  const MountingEstimate& estimate() const { return estimate_; }
  bool started() const { return estimate_.frames > 0; }
  /// The last floor was set aside.
  bool off() const { return !aside_.empty(); }

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, MountingTracker& v) {
    a(v.begun_, v.state_, v.P_, v.ground_, v.ground_frames_, v.lag_one_, v.previous_, v.reported_,
      v.aside_, v.estimate_);
  }

 private:
  Eigen::Vector3d observe_ground(const Eigen::Vector3d& innovation,
                                 const Eigen::Vector3d& expected);
  bool is_knock(const Eigen::Vector3d& measured) const;
  void set_aside(const Eigen::Vector3d& measured, const Eigen::Matrix3d& R);
  void publish(const SE3& T_body_camera_calibrated);

  FloorOptions options_;
  std::optional<Eigen::Vector3d> begun_;  ///< what begin() set, in place of the calibrated
  Eigen::Vector3d state_ = Eigen::Vector3d::Zero();  ///< roll, pitch (rad), height (m)
  Eigen::Matrix3d P_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d ground_;     ///< variances of the ground, as state_
  double ground_frames_ = 10;  ///< images that ground_ stood for before the first
  Eigen::Vector3d lag_one_;    ///< covariances of successive innovations
  Eigen::Vector3d previous_ = Eigen::Vector3d::Zero();  ///< innovation, not of those set aside
  Eigen::Vector3d reported_ = Eigen::Vector3d::Zero();
  std::deque<Eigen::Vector3d> aside_;
  bool knocks_accepted_ = true;  // told anew for every frame
  MountingEstimate estimate_;
};

}  // namespace lamina
