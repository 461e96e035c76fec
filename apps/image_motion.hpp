// Motions that wheels told, told better by depth images.
#pragma once

#include <functional>
#include <vector>

#include <lamina/apps/front_end.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {

/// A second look over the depth images, once errors of wheels and mountings are out of the steps:
/// depth odometry with the wheels for a prior gives the motions between images, in all directions
/// that surfaces hold. Steps whose image is not there, or says nothing, keep the wheels' motion.
/// `recording` is used up. For steps of wheels and depth images alone. Returns how many motions
/// images told; `ended` returning true stops early.
int refine_motions_by_images(Recording& recording, const DepthDistortion& distortion,
                             std::vector<Step>& steps, const std::function<bool()>& ended);

}  // namespace lamina::apps
