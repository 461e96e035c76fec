// Images and steps go side by side, by their stamps.
#include <lamina/apps/image_motion.hpp>

#include <lamina/apps/depth_images.hpp>

namespace lamina::apps {

int refine_motions_by_images(Recording& recording, const DepthDistortion& distortion,
                             std::vector<Step>& steps, const std::function<bool()>& ended) {
  DepthOdometry odometry;
  int told = 0;
  std::size_t i = 0;
  bool follows = false;  // the image of the step before was seen
  while (!ended()) {
    auto frame = next_depth_image(recording, 0);
    if (!frame) break;
    const std::size_t before = i;
    while (i < steps.size() && steps[i].observations.stamp < frame->stamp) ++i;
    if (i == steps.size() || frame->stamp < steps[i].observations.stamp) continue;
    follows = follows && i <= before;
    Step& step = steps[i];
    distortion.correct(*frame);
    frame->camera.camera.T_body_camera = step.observations.T_body_sensor;
    const Increment wheels = step.motion;
    const DepthMotion motion =
        odometry.process(*frame, MotionGuess{wheels.T_from_to, wheels.covariance});
    const bool measured = motion.status == ScanMotion::Status::kTracked ||
                          motion.status == ScanMotion::Status::kDegenerate;
    if (follows && measured && step.motion_known && !motion.doubtful) {
      step.motion = {motion.T_prev_curr_body, motion.covariance};
      ++told;
    }
    follows = true;
    ++i;
  }
  return told;
}

}  // namespace lamina::apps
