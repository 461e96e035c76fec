// Depth frame and its floor in, one scan of positive and negative obstacles out.
#pragma once

#include <memory>

#include <lamina/frontend/depth/floor_result.hpp>
#include <lamina/frontend/obstacles/scan_options.hpp>
#include <lamina/sensors/depth_frame.hpp>
#include <lamina/sensors/obstacle_scan.hpp>

namespace lamina {

struct DisparityImage;

/// The method of the document on negative obstacles, mended (docs/obstacles.md): positive scan,
/// farthest contiguous floor, virtual floor projection, and their least range per beam. Keeps
/// buffers between frames; not to be shared by threads. Same frames, same results.
class ObstacleScanner {
 public:
  /// Throws lamina::Error naming the first problem of the options.
  explicit ObstacleScanner(const ScanOptions& options = {});
  ~ObstacleScanner();
  ObstacleScanner(ObstacleScanner&&) noexcept;
  ObstacleScanner& operator=(ObstacleScanner&&) noexcept;

  /// `floor`: of FloorFrontend::process(frame). Any frame is legal. Where no floor was found the
  /// scan holds obstacles by the tracked mounting, and no statement about the ground.
  ObstacleScan process(const DepthFrame& frame, const FloorResult& floor);
  /// The same with the frame's disparities, which FloorFrontend::disparities() has already.
  ObstacleScan process(const DepthFrame& frame, const FloorResult& floor,
                       const DisparityImage& disparities);

  const ScanOptions& options() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lamina
