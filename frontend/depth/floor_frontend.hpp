// The floor front-end: a depth image or a cloud in; planes, floor surface and surfels out.
#pragma once

#include <memory>

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/floor_result.hpp>
#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/sensors/depth_frame.hpp>
#include <lamina/sensors/measurement.hpp>

namespace lamina {

struct DisparityImage;

class ArchiveWriter;
class ArchiveReader;

/// The method of [FloorRansac] (docs/floor.md): region of interest, sub-sections, outliers,
/// recursive RANSAC with the last normal as prior, dominant and sub-dominant planes, surfels.
/// Depth images take a fast way over pixel blocks in disparity, where a plane is linear and noise
/// constant; clouds take the steps as written, through PCL. Keeps buffers, the last floor and the
/// tracked mounting between frames; not to be shared by threads. Same frames, same results.
class FloorFrontend {
 public:
  /// Throws lamina::Error naming the first problem of the options.
  explicit FloorFrontend(const FloorOptions& options = {});
  ~FloorFrontend();
  FloorFrontend(FloorFrontend&&) noexcept;
  FloorFrontend& operator=(FloorFrontend&&) noexcept;

  /// Any frame is legal: an empty or senseless one gives a status and no planes.
  FloorResult process(const DepthFrame& frame);
  FloorResult process(const CloudFrame& frame);

  /// How the camera is mounted, where that is known before the first frame.
  void begin(const SE3& T_body_camera_calibrated, const Leveling& mounting);
  /// MountingTracker::expect_ground(), before the first frame.
  void expect_ground(const Leveling& sigma);
  /// False where the ground slopes: a floor that is off there is no knocked camera. For the frames
  /// to come.
  void accept_knocks(bool accepted);
  /// The last floor was not what the tracked mounting expects.
  bool floor_off() const;

  /// Frame after frame showed one and the same floor where the calibration has none.
  bool calibration_wrong() const;

  /// Of the last depth frame (frontend/floor/blocks.hpp): ObstacleScanner need not make them again.
  const DisparityImage& disparities() const;

  const FloorOptions& options() const;
  /// Forgets the last floor and the tracked mounting.
  void reset();
  /// For archives (models/archive.hpp): all that one call leaves to the next.
  void save(ArchiveWriter& archive) const;
  void load(ArchiveReader& archive);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lamina
