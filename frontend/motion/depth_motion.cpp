// What an image is believed to tell.
#include <lamina/frontend/motion/depth_motion.hpp>

namespace lamina {

ImageMotionResult ImageTrack::add(const DepthFrame& frame, std::optional<Timestamp> before,
                                  const std::optional<MotionGuess>& guess) {
  constexpr double kGuessedHeading = 0.5;  // rad: a map turned by that is another map
  if (last_ != before) odometry_ = DepthOdometry(odometry_.options());
  const DepthMotion motion = odometry_.process(frame, guess);
  ImageMotionResult observed;
  observed.increment = {motion.T_prev_curr_body, motion.covariance};
  observed.first = motion.status == ScanMotion::Status::kFirst;
  observed.known = motion.status != ScanMotion::Status::kPredicted;
  observed.open_direction = motion.status == ScanMotion::Status::kDegenerate;
  observed.doubtful = motion.doubtful;
  if (guess && !observed.first) observed.left_to_wheels = lamina::left_to_wheels(motion, *guess);
  // Over longer gaps motion is not extrapolated: what an image leaves open, nothing tells then.
  const bool far = before && frame.stamp - *before > odometry_.options().rest_time;
  observed.lost = !observed.known || motion.doubtful || (observed.open_direction && far) ||
                  motion.heading_guessed > kGuessedHeading;
  last_ = frame.stamp;
  return observed;
}

}  // namespace lamina
