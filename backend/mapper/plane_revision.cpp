// Hypotheses of merged, parted and shifted planes, each by the evidence of the refined graph.
#include <lamina/backend/mapper/plane_revision.hpp>

#include <cmath>
#include <utility>

#include <lamina/backend/association/outline_split.hpp>
#include <lamina/backend/consistency/hypothesis_test.hpp>
#include <lamina/backend/consistency/joint_duplicates.hpp>
#include <lamina/backend/consistency/merge_candidates.hpp>
#include <lamina/backend/consistency/occluded_duplicates.hpp>
#include <lamina/backend/consistency/shifted_associations.hpp>
#include <lamina/backend/consistency/split_candidates.hpp>
#include <lamina/backend/mapper/fallen_planes.hpp>
#include <lamina/backend/mapper/joint_surfels.hpp>

namespace lamina {
namespace {

using Pairs = std::vector<std::pair<PlaneId, PlaneId>>;
using Progress = std::function<bool(const RefineProgress&)>;

// Share of what some views of a plane saw that views which the refiner accepts saw, too.
double seen_by_pinned(const Graph& graph, const PlaneLandmark& plane,
                      const std::vector<OutlinePiece>& pieces, std::span<const std::size_t> views,
                      double cell) {
  std::set<KeyframeId> accepted, suspected;
  for (const auto& f : graph.plane_moments) {
    if (f.plane == plane.id && f.weight >= 0.5) accepted.insert(f.keyframe);
  }
  for (const std::size_t i : views) suspected.insert(graph.plane_moments[i].keyframe);
  std::vector<OutlinePiece> kept;
  for (const auto& piece : pieces) {
    if (accepted.count(piece.keyframe)) kept.push_back(piece);
  }
  PlaneLandmark known = plane;
  remake_outline(known, kept, graph, cell);
  const SE3 T_outline_map = known.T_map_outline.inverse();
  std::size_t all = 0, inside = 0;
  for (const auto& piece : pieces) {
    if (!suspected.count(piece.keyframe) || piece.points_body.size() < 3) continue;
    const SE3 T_outline_body = T_outline_map * graph.at(piece.keyframe).T_map_body;
    for (const auto& p : sample_outline(piece.points_body, cell)) {
      ++all;
      inside += known.outline.contains((T_outline_body * p).head<2>()) ? 1 : 0;
    }
  }
  return all > 0 ? static_cast<double>(inside) / static_cast<double>(all) : 0;
}

// Once more, and what it took in all.
RefineResult refine_again(Graph& graph, const RefineResult& before, const RefineOptions& options,
                          const std::function<bool(const RefineProgress&)>& progress) {
  RefineResult next = lamina::refine(graph, options, progress);
  next.iterations += before.iterations;
  next.rounds += before.rounds;
  next.solve_s += before.solve_s;
  return next;
}

// One revision: the map, how it is refined, and which planes were found to be two.
struct Revision {
  WorkingMap& map;
  PlaneMerging& merging;
  const RefineOptions& options;
  const Progress& progress;
  const DoubleOptions duplicates;
  PlanePairs apart = {};
  /// Few views of ground that swells: one place of it is one surface, whether they fit it or not.
  std::set<PlaneId> of_ground = {};

  std::size_t join(const Pairs& pairs) {
    for (const auto& [from, into] : pairs) merging.join(map, from, into);
    return pairs.size();
  }

  void share_outlines(PlaneId old, PlaneId made) {
    share_pieces(map.graph, old, made, map.outlines[old], map.outlines[made]);
  }

  // One place of a surface is one surface: where accepted views saw it, too, others that lie a
  // little off or turned are mistaken, not of another one.
  bool is_other_surface(PlaneId old, const Plane& made, std::span<const std::size_t> views) {
    constexpr double kALittleOff = 0.1;  // m: farther off is another surface, a panel before a wall
    constexpr double kCovered = 0.6;     // of what some views saw others saw, too
    const PlaneLandmark& plane = map.graph.at(old);
    const double angle = map.options.association.max_angle_deg * (M_PI / 180.0);
    if (angle_between(made, plane.plane_map()) > angle) return true;
    double off = 0;
    for (const std::size_t view : views) {
      const PlaneMomentsFactor& f = map.graph.plane_moments[view];
      off += std::abs(plane.plane_map().signed_distance(map.graph.at(f.keyframe).T_map_body *
                                                        f.moments_body.mean()));
    }
    if (off > kALittleOff * static_cast<double>(views.size())) return true;
    return seen_by_pinned(map.graph, plane, map.outlines[old], views, map.options.outline_cell_m) <
           kCovered;
  }

  // Views that were rejected but agree among themselves become a plane of their own, which is not
  // the one they left.
  std::size_t part_rejected(const std::vector<FactorRef>& rejected) {
    SplitOptions split_options;
    split_options.accept = [this](PlaneId old, const Plane& made,
                                  std::span<const std::size_t> views) {
      return is_other_surface(old, made, views);
    };
    const auto split = split_rejected(map.graph, rejected, split_options);
    for (const auto& [old, made] : split) {
      apart.insert({old, made});
      share_outlines(old, made);
    }
    return split.size();
  }

  std::size_t merge_lines() {
    return join(find_line_doubles(map.graph, map.outlines, map.options.prior_tilt_deg * M_PI / 180,
                                  duplicates));
  }

  Pairs merge_refined() {
    const Graph& graph = map.graph;
    auto pairs = find_doubles(graph, map.outlines, apart, duplicates);
    std::set<PlaneId> go;
    for (const auto& [from, into] : pairs) go.insert(from);
    for (const auto& pair : find_joint_duplicates(graph, map.outlines, apart, duplicates)) {
      if (go.count(pair.first) || go.count(pair.second)) continue;
      pairs.push_back(pair);
    }
    if (pairs.empty()) {
      pairs = find_slivers(graph, map.outlines, apart, duplicates);
      for (const auto& [from, into] : pairs) {
        if (duplicates.ground_tilt.count(into)) of_ground.insert(from);
      }
    }
    if (pairs.empty()) pairs = find_occluded_duplicates(graph, map.outlines, apart, duplicates);
    join(pairs);
    return pairs;
  }

  // Names of planes in a row that have slipped by one.
  std::size_t test_shifts(const RefineResult& refined) {
    const auto reconsidered = test_shifted_associations(
        map.graph, find_shifted_associations(map.graph, map.outlines, duplicates), duplicates.gate,
        refined, options, progress);
    if (!reconsidered) return 0;
    share_outlines(reconsidered->into, reconsidered->beside);
    merging.join(map, reconsidered->from, reconsidered->into);
    return 1;
  }

  // Planes that are seen through each other.
  std::size_t test_merges(const RefineResult& refined) {
    return join(test_merge_hypotheses(map.graph,
                                      find_seen_through(map.graph, map.outlines, apart, duplicates),
                                      refined, options, progress));
  }

  RefineResult run(RefineResult result) {
    const int most_rounds = options.thorough ? 4 : 2;
    constexpr int kMostShifts = 3;
    const bool merge = map.options.merge_planes, test = options.thorough && merge;
    Pairs merged;
    bool reconsidered = false;
    int shifts = 0;
    for (int round = 0; round < most_rounds + shifts; ++round) {
      std::erase_if(merged, [this](const auto& pair) { return of_ground.count(pair.first) > 0; });
      std::size_t changes = merging.undo_contradicted(map, merged, apart);
      changes += stand_up_fallen(map);
      if (round == 0) {
        changes += part_rejected(result.rejected);
        map.remake_outlines();
        if (merge) changes += merge_lines();
      }
      merged.clear();
      if (merge && round + 1 < most_rounds + shifts) merged = merge_refined();
      changes += merged.size();
      if (changes == 0 && test && shifts < kMostShifts && test_shifts(result) > 0) {
        ++changes;
        ++shifts;
      }
      if (changes == 0 && test && !reconsidered) {
        reconsidered = true;
        changes += test_merges(result);
      }
      if (changes == 0) break;
      map.remake_outlines();
      RefineOptions again = options;
      again.refined_before = round > 0;
      again.thorough = false;  // loops that were left out were reconsidered once
      result = refine_again(map.graph, result, again, progress);
      if (result.status == SolveStatus::kCancelled) break;
    }
    map.remake_outlines();
    return result;
  }
};

// By how much views of rough floors are turned: heights of stationary ground over its correlation
// length, as GroundWatch::lift_variances() has it.
std::map<PlaneId, double> ground_tilt(const WorkingMap& map) {
  std::map<PlaneId, double> tilt;
  if (!map.options.ground.enabled) return tilt;
  const JointSurfelOptions& surfels = map.options.joint_surfels;
  for (const auto& [id, roughness] : floor_roughness(map.graph, map.surfels, surfels)) {
    if (roughness < surfels.least_roughness_m) continue;
    tilt[id] = 2 * M_SQRT2 * roughness / map.options.ground.correlation_m;
  }
  return tilt;
}

}  // namespace

RefineResult revise_planes(WorkingMap& map, PlaneMerging& merging, RefineResult result,
                           const RefineOptions& options,
                           const std::function<bool(const RefineProgress&)>& progress) {
  DoubleOptions duplicates;
  duplicates.association = map.options.association;
  duplicates.ground_tilt = ground_tilt(map);
  return Revision{map, merging, options, progress, duplicates}.run(std::move(result));
}

void drop_unsupported(WorkingMap& map) {
  std::set<PlaneId> supported;
  for (const auto& f : map.graph.plane_moments) {
    if (f.weight >= 0.5) supported.insert(f.plane);
  }
  for (auto& plane : map.graph.planes) {
    if (!plane.active || supported.count(plane.id) || map.window.contains(plane.id)) continue;
    plane.active = false;
    map.index.remove(plane.id);
  }
}

}  // namespace lamina
