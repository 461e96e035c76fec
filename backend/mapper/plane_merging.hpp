// Planes that are one become one, and two again where that was wrong.
#pragma once

#include <lamina/backend/mapper/working_map.hpp>

namespace lamina {

using PlanePairs = std::set<std::pair<PlaneId, PlaneId>>;

/// What undo() needs.
struct MergeRecord {
  PlaneLandmark landmark;
  std::vector<PlaneMomentsFactor> factors;
  std::vector<OutlinePiece> outlines;
  std::vector<MarginalPrior> priors;
  bool stood = false;  ///< through a refinement
};

/// Merges planes of a map, and keeps what takes a merge back.
class PlaneMerging {
 public:
  /// Gives all of `from` to `into`, in the window, where it is there, and in the graph.
  void join(WorkingMap& map, PlaneId from, PlaneId into);
  /// The graph's part of that; the window's is the caller's.
  void absorb(WorkingMap& map, PlaneId from, PlaneId into);
  /// Joins planes of the window that have come together with what the present keyframe saw: pairs
  /// (from, into).
  std::vector<std::pair<PlaneId, PlaneId>> merge_coplanar(WorkingMap& map);

  /// `from` is a plane of its own again with the evidence it had. False when it was not merged, or
  /// that has stood through two refinements. What the window's prior has taken in stays with the
  /// other plane.
  bool undo(WorkingMap& map, PlaneId from);
  /// Undoes those of `merged` of which the refiner, all in one, rejects more than half of what one
  /// side saw; they are apart from then on. How many.
  std::size_t undo_contradicted(WorkingMap& map,
                                const std::vector<std::pair<PlaneId, PlaneId>>& merged,
                                PlanePairs& apart);
  /// The graph was refined: what stands through two refinements is not undone any more.
  void refined();
  /// Everything in another map frame.
  void move(const SE3& T_new_map);

 private:
  std::map<PlaneId, MergeRecord> merges_;  // by the plane that went
};

}  // namespace lamina
