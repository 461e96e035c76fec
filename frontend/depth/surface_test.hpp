// Is a region a surface, or posts and rails that a plane happens to hold?
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/frontend/depth/plane_regions.hpp>

namespace lamina {

/// Runs of a region's pixels along sampled rows (or columns), and how many of them end in the open
/// on both sides: what is measured beside them lies behind the region's plane.
struct RunEvidence {
  double runs = 0, free_runs = 0, pixels = 0;
  double length() const { return runs > 0 ? pixels / runs : 0; }
  double free_share() const { return runs > 0 ? free_runs / runs : 0; }
};

struct RegionEvidence {
  RunEvidence across, down;  ///< along rows, along columns
};

/// Evidence of every region from every `step`-th row and column of the pixel labels. `gate` (px of
/// disparity): what is nearer to the plane than this is beside it, not behind it.
std::vector<RegionEvidence> gather_evidence(const DisparityImage& image, const DisparityGeometry& g,
                                            const std::vector<std::uint8_t>& pixel_labels,
                                            const std::vector<PlaneRegion>& regions, int step,
                                            float gate);

/// Whether runs and residuals are those of a surface. `misfit`: rms of the residuals over what
/// noise leaves. Only narrow regions are doubted, for a large one proves itself; they are refused
/// when strips stand in the open on both sides and are very thin or bent (posts, rails, legs), and
/// when the plane fits so badly that it must hold several surfaces.
bool is_surface(const RegionEvidence& evidence, double misfit);

/// rms of a region's residuals over what the noise of its pixels leaves: disparity, and half a
/// pixel of jitter beside the pixel [Barron2013] times the plane's slope.
double misfit(const PlaneRegion& region, const BlockNoise& noise);

}  // namespace lamina
