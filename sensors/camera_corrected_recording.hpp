// A recording whose cameras' calibration was wrong, as if it had been right.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <lamina/sensors/camera_correction.hpp>
#include <lamina/sensors/forwarding_recording.hpp>

namespace lamina {

/// What is to be done to images.
struct CameraFixes {
  CameraCorrection depth, stereo;
  /// Raw depths, from the least to the largest, that are codes for no measurement.
  std::optional<std::pair<std::uint16_t, std::uint16_t>> depth_code;
  /// Pixels, row-major, that show the robot itself (or dirt): no measurement. Empty: none.
  std::vector<bool> robot;
  bool swap_stereo = false;  ///< left and right images change places
  bool swap_some = false;    ///< those of pairs that match better so
  int right_late = 0;        ///< pairs by which right images are late; below 0: left ones are
  bool drop_depth = false;   ///< nothing can be made of depth images
  double depth_reach = 0;    ///< m, beyond which nothing is measured; 0: as the noise model says
  /// Of depth images, pixels themselves.
  bool changes_depths() const { return depth_code || !robot.empty() || depth.changes_depths(); }
  bool any() const {
    return depth.any() || stereo.any() || changes_depths() || swap_stereo || swap_some ||
           right_late != 0 || drop_depth || depth_reach > 0;
  }
};

/// Share of the left image's pixels whose like is in the right one.
double matched_share(const StereoFrame& pair);
/// Hardly any is, but twice as many and more with left and right swapped.
bool is_swapped(const StereoFrame& pair);

/// The depth image, corrected.
void apply(const CameraFixes& fixes, DepthFrame& frame);
/// Only what stands in its pixels, the camera's model stays as stated.
void apply_to_depths(const CameraFixes& fixes, DepthFrame& frame);
/// The pair, corrected: an offset moves the right image by so many pixels.
void apply(const CameraFixes& fixes, StereoFrame& pair);

/// The source's measurements, corrected, in their order.
class CameraCorrectedRecording final : public ForwardingRecording {
 public:
  CameraCorrectedRecording(std::unique_ptr<Recording> source, const CameraFixes& fixes);

  std::optional<Measurement> next() override;
  std::optional<DepthFrame> next_depth(std::int64_t skip) override;
  const Calibration& calibration() const override;
  SkippedCounts skipped() const override;

 private:
  std::optional<Measurement> next_of_source();
  std::optional<Measurement> next_with_later_right();

  CameraFixes fixes_;
  mutable Calibration calibration_;
  std::deque<Measurement> held_;  // from the first pair on that waits for its right image
  bool ended_ = false;
  std::int64_t dropped_ = 0;
};

/// The source's measurements by these fixes; `source` itself where there are none.
std::unique_ptr<Recording> corrected(std::unique_ptr<Recording> source, const CameraFixes& fixes);

}  // namespace lamina
