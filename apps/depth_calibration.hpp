// A first look over a recording's depth images, for what all of them share.
#pragma once

#include <functional>

#include <lamina/frontend/floor/depth_distortion.hpp>
#include <lamina/frontend/floor/floor_options.hpp>
#include <lamina/io/metrics.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {

/// The slow bend of the images as planes in some 120 of them show it, spread over the recording
/// (over its first 1,200 where the source cannot say how many it has); empty where they show none
/// or `ended` asks to stop. What was found goes to the log and to the counts of `metrics`.
/// `recording` is used up.
DepthDistortion calibrate_depth(Recording& recording, const FloorOptions& options,
                                io::Metrics& metrics, const std::function<bool()>& ended);

}  // namespace lamina::apps
