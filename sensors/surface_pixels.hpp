// Which pixels of a depth image show surfaces, and which are noise.
#pragma once

#include <cstdint>

#include <lamina/sensors/forwarding_recording.hpp>

namespace lamina {

struct SurfacePixelsOptions {
  int block = 8;         ///< pixels, side of the squares that are judged
  double sigmas = 3;     ///< of the difference of two pixels: so near, they agree
  double near = 0.02;    ///< or so near, as a share of the depth: the noise stated may be too small
  double share = 0.5;    ///< of a block's pixels that agree with no neighbour they have, at most
  double warned = 0.01;  ///< of all pixels of a recording that were left out: a warning from there
};

/// What was left out of images.
struct PixelsLeftOut {
  std::int64_t pixels = 0, of = 0;    ///< of those with a measurement
  int first_row = -1, last_row = -1;  ///< between which they lie; below 0: none
};

/// Surfaces cover more than a pixel. Blocks in which most pixels agree with none of their four
/// neighbours, by the camera's noise, show none (broken cables, foreign light, damaged files): they
/// are set to 0. Cost O(pixels).
PixelsLeftOut leave_surfaces(DepthFrame& frame, const SurfacePixelsOptions& options = {});

/// The source's measurements, its depth images so; warns of "depth_damaged".
class SurfacesRecording final : public ForwardingRecording {
 public:
  explicit SurfacesRecording(std::unique_ptr<Recording> source,
                             const SurfacePixelsOptions& options = {});

  std::optional<Measurement> next() override;
  std::optional<DepthFrame> next_depth(std::int64_t skip) override;
  std::vector<Warning> warnings() const override;

 private:
  void apply(DepthFrame& frame);

  SurfacePixelsOptions options_;
  PixelsLeftOut left_out_;
  std::optional<Timestamp> first_;  // image with any
};

}  // namespace lamina
