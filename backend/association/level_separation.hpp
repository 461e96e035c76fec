// Level pieces with a lower surface seen between them: two platforms, not one floor.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include <lamina/backend/association/association.hpp>
#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// What is known of a level surface, in the map frame (z up).
class LevelSheet {
 public:
  /// nullopt for planes whose normal is more than 20 degrees off z, for strokes of scans, and where
  /// nothing was seen. The sheet refers to `plane`.
  static std::optional<LevelSheet> of(const PlaneLandmark& plane);
  static std::optional<LevelSheet> of(const PlaneEvidence& evidence, const SE3& T_map_body);

  double height(const Eigen::Vector2d& at) const;  ///< m
  /// Whether it was seen there. Outlines have no holes: a floor is seen under its platforms, too.
  bool covers(const Eigen::Vector2d& at) const;
  std::vector<Eigen::Vector2d> rim() const;  ///< points at most 0.1 m or a cell apart
  /// The ground the robot stands on, as far as images say. It has no gaps but pits.
  bool ground() const { return ground_; }

 private:
  LevelSheet(const Plane& plane_map, const LabelVotes& votes);
  Plane plane_map_;
  bool ground_;
  const PlaneLandmark* landmark_ = nullptr;  // seen where its grid says, else where
  SE3 T_outline_map_;
  Polygon polygon_;  // this does
};

/// Whether a lower surface was seen between two sheets: along most of the shortest way from one to
/// the other (5 cm at least) the uppermost of `sheets` lies below both by more than three times
/// `surface_sigma_m`, what surfaces deviate from planes by. That deviation says how far two pieces
/// of *one* surface may differ; across a lower one there is none that both could be of. False where
/// nothing was seen between, where the two overlap in plan, and where one of them is ground: beyond
/// a pit the floor goes on.
bool lower_between(const LevelSheet& a, const LevelSheet& b, std::span<const LevelSheet> sheets,
                   double surface_sigma_m);

/// The same for evidence[i] and evidence[j] of one image.
bool lower_between(std::span<const PlaneEvidence> evidence, std::size_t i, std::size_t j,
                   const SE3& T_map_body, double surface_sigma_m);

/// Level planes of a graph that are two though they are nearly level with each other, while the
/// graph stays as it is.
class LevelGaps {
 public:
  /// `outlines`: what keyframes saw of each plane. Factors are believed as the graph weighs them.
  /// Edges are looked for in keyframes from `first` on.
  LevelGaps(const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
            const AssociationOptions& options, KeyframeId first = KeyframeId::kNone);
  /// Whether a lower plane was seen between the two (lower_between), however little lower where
  /// keyframes saw the edges of both towards it: plates of 1 cm.
  bool between(PlaneId a, PlaneId b) const;
  /// Whether keyframes saw an edge: in most of those that saw both, where the smaller view borders
  /// on the other in plan, one stands above the other by more than three sigmas of the two views
  /// along nearly all of the border. A plane that took in others has several views in a keyframe.
  /// No pose stands between the two, and what a surface deviates from a plane by shows within
  /// views, not at their borders.
  bool step(PlaneId a, PlaneId b) const;
  bool apart(PlaneId a, PlaneId b) const { return between(a, b) || step(a, b); }

 private:
  struct View {
    Plane plane_map;
    Eigen::Vector2d middle;
    Eigen::Matrix3d covariance;  // of height at the middle and the two slopes
    Polygon plan;
    double variance(const Eigen::Vector2d& at) const;
  };
  void add_views(const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
                 KeyframeId first);
  static std::optional<bool> step(const std::vector<View>& a, const std::vector<View>& b);

  AssociationOptions options_;
  std::vector<LevelSheet> sheets_;
  std::vector<PlaneId> ids_;  // of the sheets
  std::map<PlaneId, std::size_t> sheet_of_;
  std::map<PlaneId, std::map<KeyframeId, std::vector<View>>> views_;
};

}  // namespace lamina
