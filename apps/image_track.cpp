// What an image is believed to tell.
#include <lamina/apps/image_track.hpp>

namespace lamina::apps {

ImageMotionTold ImageTrack::add(const DepthFrame& frame, std::optional<Timestamp> before,
                                const std::optional<MotionGuess>& guess) {
  constexpr double kGuessedHeading = 0.5;  // rad: a map turned by that is another map
  if (last_ != before) odometry_ = DepthOdometry(odometry_.options());
  const DepthMotion motion = odometry_.process(frame, guess);
  ImageMotionTold told;
  told.increment = {motion.T_prev_curr_body, motion.covariance};
  told.first = motion.status == ScanMotion::Status::kFirst;
  told.known = motion.status != ScanMotion::Status::kPredicted;
  told.open_direction = motion.status == ScanMotion::Status::kDegenerate;
  told.doubtful = motion.doubtful;
  if (guess && !told.first) told.left_to_wheels = lamina::left_to_wheels(motion, *guess);
  // Over longer gaps motion is not extrapolated: what an image leaves open, nothing tells then.
  const bool far = before && frame.stamp - *before > odometry_.options().rest_time;
  told.lost = !told.known || motion.doubtful || (told.open_direction && far) ||
              motion.heading_guessed > kGuessedHeading;
  last_ = frame.stamp;
  return told;
}

}  // namespace lamina::apps
