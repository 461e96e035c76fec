// Floor planes cut into surfels and patches of evidence.
#pragma once

#include <lamina/frontend/depth/plane_extractor.hpp>

namespace lamina {

/// Fills result.surfels_body and result.floor_patches, one of each a square of surfel_m on the
/// dominant and sub-dominant planes: the patch holds the moments of its pixels (camera frame,
/// weights 1/sigma^2), the surfel its plane's height and tilt there, the radius of the disc of the
/// patch's area, and a covariance of (tilt, tilt, height) from its own pixels, tied to the parent
/// plane's tilt where they say less, with the noise floor added.
void make_surfels(const PlaneExtractor& extractor, const FloorOptions& options,
                  FloorResult& result);

}  // namespace lamina
