// Motion by depth images alone: for a camera that is all there is, and where all else has stopped.
#pragma once

#include <optional>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/observability.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>

namespace lamina {

/// What one image told of the way since the one before.
struct ImageMotionResult {
  Increment increment;          ///< of the body; the first's says nothing
  bool first = false;           ///< nothing before it to compare with
  bool known = false;           ///< measured in some directions at least
  bool open_direction = false;  ///< but not in all
  bool doubtful = false;        ///< may be the motion of what moved
  LeftToWheels left_to_wheels;  ///< where these were asked
  bool lost = false;            ///< not believed as all that tells the motion
};

/// DepthOdometry over images that follow each other, begun anew where one was not shown to it.
class ImageTrack {
 public:
  /// `frame` with the mounting its motion is asked for; `before`: stamp of the image before it;
  /// `guess`: what else tells the way from there.
  ImageMotionResult add(const DepthFrame& frame, std::optional<Timestamp> before,
                        const std::optional<MotionGuess>& guess = {});

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, ImageTrack& v) {
    a(v.odometry_, v.last_);
  }

 private:
  DepthOdometry odometry_;
  std::optional<Timestamp> last_;
};

}  // namespace lamina
