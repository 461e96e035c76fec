// Whether a camera can be what is stated of it.
#pragma once

#include <optional>
#include <string>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// Why no image comes from such a camera: "fx nan, fy 525, cx 319.5, cy 239.5 for 640 x 480
/// pixels". Empty where one may: numbers, a field of view between 1 and 170 degrees, pixels not
/// thrice as wide as high, a principal point within an image's width of the image.
std::string senseless_intrinsics(const CameraModel& camera);

/// Intrinsics stated for images of another size: scaled to those there are, where both are of one
/// shape (to 2 %); false, and unchanged, where they are not.
bool scale_intrinsics(CameraModel& camera, int stated_width, int stated_height);

/// A principal point on the image's edge or beyond is none: 0 was never set, the last column is the
/// middle of an image twice as wide. Mended, and said; nullopt where nothing was amiss. `where`:
/// file or topic.
std::optional<Warning> mend_principal_point(CameraModel& camera, const std::string& where);

/// The noise of the same sensor where its focal length is `factor` times as long.
DepthNoise noise_at_focal(DepthNoise noise, double factor);

}  // namespace lamina
