// What keyframes that see two planes at once say of them: no pose stands between.
#pragma once

#include <map>
#include <optional>
#include <set>

#include <lamina/backend/association/association.hpp>
#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// The views of every plane by keyframe, those of one keyframe as one.
class SameViewSeparation {
 public:
  /// `gate`: chi-squared beyond which two views of a keyframe are not of one plane. Views of less
  /// than `least_weight` do not count: 0.5, those that the refiner rejected.
  SameViewSeparation(const Graph& graph, const AssociationOptions& options, double gate,
                     double least_weight = 0.5);

  /// How far a stands before b (m, along b's normal) as keyframes that tell them apart see it.
  struct Offset {
    double mean = 0;
    double variance = 0;           ///< of one keyframe's word: what surfaces are off by stays
    std::set<KeyframeId> seen_by;  ///< that tell them apart
  };
  /// nullopt: no keyframe tells them apart. The two may lean on each other a little: strokes of one
  /// scan all lie in the scan's own plane.
  std::optional<Offset> offset(PlaneId a, PlaneId b) const;
  bool separated(PlaneId a, PlaneId b) const { return offset(a, b).has_value(); }

 private:
  const Graph& graph_;
  double lean_, gate_;
  std::map<PlaneId, std::map<KeyframeId, Moments>> views_;
};

}  // namespace lamina
