// The plane stage: a depth image in, whole planes and labels out.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/floor_result.hpp>
#include <lamina/frontend/depth/pixel_labels.hpp>
#include <lamina/frontend/depth/sections.hpp>

namespace lamina {

/// What is believed of the mounting before a frame is looked at.
struct MountingPrior {
  SE3 T_body_camera;
  bool known = true;  ///< false: height and tilt are not to be trusted at all
};

/// Steps of [FloorRansac] on blocks. Keeps its buffers between frames.
class PlaneExtractor {
 public:
  explicit PlaneExtractor(const FloorOptions& options) : options_(options), sections_(options) {}

  /// Fills everything below; planes largest first.
  void extract(const DepthFrame& frame, const MountingPrior& prior);

  const DisparityImage& image() const { return image_; }
  const DisparityGeometry& geometry() const { return geometry_; }
  const BlockImage& blocks() const { return blocks_; }
  const BlockNoise& noise() const { return noise_; }
  /// Of the pixels of the last image over the model's.
  double noise_scale() const { return noise_scale_; }
  const PlaneRegions& regions() const { return regions_; }
  std::vector<std::uint8_t>& pixel_labels() { return pixel_labels_; }
  const std::vector<std::int16_t>& block_labels() const { return labeller_.majority(); }
  const std::vector<std::pair<int, int>>& skipped_sections() const { return skipped_; }
  const FloorStageTimes& times() const { return times_; }
  /// The prior, levelled by a first look where the mounting is not known.
  const SE3& T_level_camera() const { return T_level_camera_; }

 private:
  void estimate_noise(const DepthNoise& model);
  void first_look(const MountingPrior& prior);
  void assign_sections();
  void extract_floor_sections(const NormalPrior& floor);
  void extract_rest();
  void drop_doubtful(float gate);
  bool is_edge(std::size_t k, double across, double down) const;
  void recurse(std::vector<int>& candidates, const NormalPrior& prior, Sampler& sampler);

  FloorOptions options_;
  SectionGrid sections_;
  DisparityImage image_;
  DisparityGeometry geometry_;
  BlockImage blocks_;
  BlockNoise noise_;
  double noise_scale_ = 1;
  PlaneRegions regions_;
  PixelLabeller labeller_;
  SE3 T_level_camera_;
  std::vector<std::vector<int>> section_blocks_;
  std::vector<std::uint8_t> pixel_labels_;
  std::vector<std::pair<int, int>> skipped_;
  FloorStageTimes times_;
};

}  // namespace lamina
