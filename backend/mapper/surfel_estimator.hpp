// Floor surfels given the poses: every cell is independent and has a closed form, so surfels are
// eliminated from the graph exactly, as bundle adjustment does its points.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/models/surfel_floor.hpp>

namespace lamina {

struct SurfelOptions {
  double cell_m = 0.1;
  double parent_sigma_m = 0.01;  ///< height off the parent plane, 1-sigma
  double parent_slope = 0.05;    ///< slope off the parent plane, m per m
  /// Cauchy's scale on the distance from the parent, in sigmas: beyond it the parent lets go, so
  /// that a 1 cm slab is not ironed flat.
  double parent_robust = 2.0;
  double level_gap_m = 0.15;  ///< evidence this far apart in height belongs to two levels
};

/// Height and slopes of one cell from its evidence (map frame, z up, weights 1/sigma^2) and its
/// parent plane (nullptr: none): the minimum of the evidence's plane cost and the robust prior, by
/// three reweighted closed forms. nullopt without evidence or when the slopes are not determined.
std::optional<SurfelCell> solve_surfel(const Moments& evidence_map, const Eigen::Vector2d& center,
                                       const Plane* parent_map, const SurfelOptions& options);

/// The plane that was seen at `x_map` and is nearest to it; null: none within `farthest` (m).
const PlaneLandmark* parent_of(const Eigen::Vector3d& x_map,
                               const std::vector<const PlaneLandmark*>& planes, double farthest);

/// Floor points by keyframe, in small squares of the keyframe's own body frame.
class SurfelEvidence {
 public:
  explicit SurfelEvidence(double cell_m = 0.1) : cell_(cell_m) {}
  void add(KeyframeId keyframe, const Moments& moments_body);
  /// Everything of `from` becomes `into`'s: T_into_from.
  void transfer(KeyframeId from, KeyframeId into, const SE3& T_into_from);
  /// Evidence of these keyframes at the poses of now: one that lies within `radius_m` of an earlier
  /// one of them hangs on that one, and what lies in one cell of the map on one keyframe: its room
  /// is that of the floor, however often it was seen.
  void condense(const Graph& graph, const std::vector<KeyframeId>& keyframes, double radius_m);
  /// The same with every point moved in its keyframe's body frame.
  SurfelEvidence moved(const SE3& T_new_old) const;
  std::size_t size() const;
  /// m, from the keyframe to the farthest of its evidence; 0 without any.
  double reach(KeyframeId keyframe) const;
  /// Those that have evidence, in order of their ids.
  std::vector<KeyframeId> keyframes() const;
  /// f(keyframe, moments in its body frame) for every square, in order.
  template <class F>
  void for_each(F&& f) const {
    for (const auto& [keyframe, squares] : evidence_) {
      for (const auto& [square, moments] : squares) f(keyframe, moments);
    }
  }
  /// The floor by the keyframes' present poses. Parents: planes within level_gap_m of the evidence
  /// whose outline is under it, nearest first.
  SurfelFloor solve(const Graph& graph, const SurfelOptions& options) const;
  /// All of `other`, its keyframes' ids raised by `keyframe_offset`. Cells must be of one size.
  void append(const SurfelEvidence& other, std::int64_t keyframe_offset);
  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, SurfelEvidence& v) {
    a(v.cell_, v.evidence_);
  }

 private:
  using Square = std::array<std::int32_t, 3>;
  Square square_of(const Eigen::Vector3d& point) const;
  double cell_;
  std::map<KeyframeId, std::map<Square, Moments>> evidence_;
};

}  // namespace lamina
