// Odometry whose poses are written in another frame or order than its format has them.
#pragma once

#include <optional>
#include <vector>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/odometry.hpp>

namespace lamina {

struct OdometryFrameOptions {
  double upright = 0.5;     ///< cosine of the body's tilt: a body tilted further fell over
  double most_stand = 0.9;  ///< share of poses that stand upright: nothing is wrong
  double all_stand = 0.99;  ///< share that must, as another way of reading has them
  double step = 0.05;       ///< m of way whose direction counts
  double least_turned = 3;  ///< rad that headings turn by, in sum
  double against =
      0.25;  ///< of it, by which ways turn the other way: right ones turn along by as much
  double quarter = 0.2;  ///< rad: an angle so near to a multiple of 90 degrees is that
};

/// A body stands upright in its odometry's frame, and one that steers goes where its heading
/// turns. Poses that hold neither are read as what explains them: quaternions as w, x, y, z; poses
/// of the camera's optical frame (`T_body_camera` where one is stated); x and y swapped or one of
/// them of another sign. Changes the samples and says so; none where nothing is wrong or nothing
/// explains it.
std::vector<Warning> mend_odometry_frame(std::vector<Odometry>& samples,
                                         const std::optional<SE3>& T_body_camera,
                                         const OdometryFrameOptions& options = {});

}  // namespace lamina
