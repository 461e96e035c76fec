// From planes in the camera frame to a floor: the choice, the mounting, and what each plane is.
#pragma once

#include <lamina/frontend/depth/dominant_floor.hpp>
#include <lamina/frontend/depth/mounting_tracker.hpp>

namespace lamina {

/// Shared by depth images and clouds. Keeps the tracked mounting and the last floor.
class FloorJudge {
 public:
  explicit FloorJudge(const FloorOptions& options) : options_(options), tracker_(options) {}

  /// What to expect of the next frame, given its calibration.
  FloorPrior prior(const SE3& T_body_camera_calibrated) const;
  /// Chooses the floor of result.planes (plane_camera, pixels, area, moments and noise set) and
  /// fills status, reason, dominant, floor_camera, T_body_camera, mounting, and the planes'
  /// plane_body, slope, height and kind.
  void judge(const SE3& T_body_camera_calibrated, double frame_pixels, FloorResult& result);

  /// MountingTracker::begin(), before the first frame.
  void begin(const SE3& T_body_camera_calibrated, const Leveling& mounting) {
    tracker_.begin(T_body_camera_calibrated, mounting);
  }
  /// MountingTracker::expect_ground(), before the first frame.
  void expect_ground(const Leveling& sigma) { tracker_.expect_ground(sigma); }
  /// Frame after frame contradicted it with one and the same floor.
  bool calibration_wrong() const { return calibration_wrong_; }
  /// MountingTracker::off().
  bool off() const { return tracker_.off(); }
  /// MountingTracker::accept_knocks(), for the frames to come.
  void accept_knocks(bool accepted) { tracker_.accept_knocks(accepted); }

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, FloorJudge& v) {
    a(v.tracker_, v.last_leveled_, v.calibration_wrong_, v.contradictions_, v.suspected_height_);
  }

 private:
  bool calibration_usable(const SE3& T_body_camera_calibrated) const;
  FloorChoice choose(const SE3& calibrated, std::span<const FloorCandidate> candidates,
                     double frame_pixels);
  void suspect_calibration(const FloorChoice& without, std::span<const FloorCandidate> candidates);
  void classify(FloorResult& result) const;

  FloorOptions options_;
  MountingTracker tracker_;
  std::optional<SE3> last_leveled_;  ///< by the last floor seen
  bool calibration_wrong_ = false;   ///< many frames agree that it cannot be right
  int contradictions_ = 0;
  double suspected_height_ = 0;
};

}  // namespace lamina
