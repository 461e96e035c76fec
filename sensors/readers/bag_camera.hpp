// The camera that a CameraInfo message states.
#pragma once

#include <string>
#include <vector>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/calibration.hpp>
#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

/// Of the images of `image`'s topic and size, not placed yet; what was mended is added to
/// `warnings`. Throws lamina::Error naming bag, topic, K where no image comes from such a camera,
/// or `info` is of images of another shape, or null. `stated`: a calibration
/// file states the focal lengths, and none of that matters.
CameraModel camera_of(const std::string& bag, const Message& image, const Message* info,
                      bool stated, std::vector<Warning>& warnings);

/// Says where floats that should be metres are millimetres.
void check_unit(const Message& image, std::vector<Warning>& warnings);

}  // namespace lamina::bag
