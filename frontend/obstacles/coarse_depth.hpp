// A depth image in squares, for votes over images of what they saw through.
#pragma once

#include <lamina/models/depth_look.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

/// Some 40 squares across the longer side of the image, of which one in ten pixels may lack a
/// measurement in the noise model's range. Empty for a frame whose raw data or geometry is none.
DepthLook depth_look(const DepthFrame& frame);

}  // namespace lamina
