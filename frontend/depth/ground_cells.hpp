// Ground cells from a labelled depth image: the floor's surface, and evidence for low obstacles.
#pragma once

#include <lamina/frontend/depth/ground_observer.hpp>
#include <lamina/frontend/depth/low_obstacles.hpp>
#include <lamina/frontend/depth/plane_extractor.hpp>

namespace lamina {

/// Sums of one ground cell over the patches of pixels that fell in it.
struct GroundSums {
  float pixels = 0, z = 0, residual = 0, depth = 0;  ///< near the floor, weighted by pixels
  float floor_pixels = 0, floor_z = 0;  ///< on the traversable plane that holds the cell
  float top = -1e9F;
  float above = 0;          ///< pixels further than the band from the reference
  std::int16_t plane = -1;  ///< index into `planes`
};

/// Walks over patches of 8 x 2 pixels inside the ROI (levelled body frame of `result`), fills
/// result.surface, .low_obstacles, .look and .obstacle_points_body, and `evidence` for memories.
class GroundMapper {
 public:
  explicit GroundMapper(const FloorOptions& options) : options_(options), observer_(options) {}
  void map(const PlaneExtractor& extractor, FloorResult& result);
  const EvidenceGrid& evidence() const { return evidence_; }

 private:
  void choose_references(const FloorResult& result);
  void fill_surface(const PlaneExtractor& extractor, FloorResult& result);
  void fill_evidence(const PlaneExtractor& extractor, const FloorResult& result);

  FloorOptions options_;
  GroundObserver observer_;
  std::vector<GroundSums> sums_;
  std::vector<int> reference_;      ///< plane -> plane its cells are compared with, -1: no floor
  std::vector<int> surface_plane_;  ///< plane -> index in FloorSurface::planes(), -1: no floor
  EvidenceGrid evidence_;
  int nx_ = 0, ny_ = 0;
};

}  // namespace lamina
