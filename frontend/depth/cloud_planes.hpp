// The document's steps on a cloud without order, through PCL.
#pragma once

#include <lamina/frontend/depth/floor_judge.hpp>
#include <lamina/frontend/depth/floor_options.hpp>
#include <lamina/frontend/depth/sections.hpp>
#include <lamina/sensors/measurement.hpp>

namespace lamina {

/// CropBox to the region of interest, sub-sections, StatisticalOutlierRemoval in each, recursive
/// SACSegmentation with a perpendicular constraint, merging of the sections' planes.
class CloudPlanes {
 public:
  explicit CloudPlanes(const FloorOptions& options) : options_(options), sections_(options) {}
  /// Fills planes (with outlines), surfels, patches and skipped sections of `result`, which holds
  /// stamp and sensor; `judge` decides what is floor.
  void process(const CloudFrame& cloud, FloorJudge& judge, FloorResult& result);

 private:
  FloorOptions options_;
  SectionGrid sections_;
};

}  // namespace lamina
