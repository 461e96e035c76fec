// After the whole graph is refined: planes that turn out to be one are merged, those that turn out
// to be two are parted again, planes that nothing supports leave.
#include <algorithm>
#include <cmath>

#include <lamina/backend/consistency/hypothesis_test.hpp>
#include <lamina/backend/consistency/joint_duplicates.hpp>
#include <lamina/backend/consistency/merge_candidates.hpp>
#include <lamina/backend/consistency/occluded_duplicates.hpp>
#include <lamina/backend/consistency/shifted_associations.hpp>
#include <lamina/backend/consistency/split_candidates.hpp>
#include <lamina/backend/mapper/mapper.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kALittleOff = 0.1;  // m: farther off is another surface, a panel before a wall
constexpr double kCovered = 0.6;     // of what some views saw others saw, too

// The plane that has the evidence of `id` now.
PlaneId successor_of(const Graph& graph, PlaneId id) {
  const PlaneLandmark* plane = graph.find(id);
  while (plane && !plane->active && plane->merged_into != PlaneId::kNone) {
    plane = graph.find(plane->merged_into);
  }
  return plane ? plane->id : PlaneId::kNone;
}

bool same_view(const PlaneMomentsFactor& a, const PlaneMomentsFactor& b) {
  return a.keyframe == b.keyframe && a.moments_body.mean() == b.moments_body.mean();
}

// Share of what some views of a plane saw that views which the refiner believes saw, too.
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

}  // namespace

// Views that were rejected but agree among themselves become a plane of their own, which is not
// the one they left.
std::size_t Mapper::part_rejected(const std::vector<FactorRef>& rejected, PlanePairs& apart) {
  // One place of a surface is one surface: where views that are believed saw it, too, others that
  // lie a little off or turned are mistaken, not of another one.
  SplitOptions options;
  options.accept = [this](PlaneId old, const Plane& made, std::span<const std::size_t> views) {
    const PlaneLandmark& plane = graph_.at(old);
    if (angle_between(made, plane.plane_map()) > options_.association.max_angle_deg * kDegree) {
      return true;
    }
    double off = 0;
    for (const std::size_t view : views) {
      const PlaneMomentsFactor& f = graph_.plane_moments[view];
      off += std::abs(plane.plane_map().signed_distance(graph_.at(f.keyframe).T_map_body *
                                                        f.moments_body.mean()));
    }
    if (off > kALittleOff * static_cast<double>(views.size())) return true;
    return seen_by_pinned(graph_, plane, outlines_[old], views, options_.outline_cell_m) < kCovered;
  };
  const auto split = split_rejected(graph_, rejected, options);
  for (const auto& [old, made] : split) {
    apart.insert({old, made});
    share_outlines(old, made);
  }
  return split.size();
}

std::size_t Mapper::merge_lines() {
  DoubleOptions options;
  options.association = options_.association;
  const auto pairs =
      find_line_doubles(graph_, outlines_, options_.prior_tilt_deg * M_PI / 180, options);
  for (const auto& [from, into] : pairs) join_planes(from, into);
  return pairs.size();
}

std::vector<std::pair<PlaneId, PlaneId>> Mapper::merge_refined(const PlanePairs& apart) {
  DoubleOptions options;
  options.association = options_.association;
  auto pairs = find_doubles(graph_, outlines_, apart, options);
  std::set<PlaneId> go;
  for (const auto& [from, into] : pairs) go.insert(from);
  for (const auto& pair : find_joint_duplicates(graph_, outlines_, apart, options)) {
    if (go.count(pair.first) || go.count(pair.second)) continue;
    pairs.push_back(pair);
  }
  if (pairs.empty()) pairs = find_slivers(graph_, outlines_, apart, options);
  if (pairs.empty()) pairs = find_occluded_duplicates(graph_, outlines_, apart, options);
  for (const auto& [from, into] : pairs) join_planes(from, into);
  return pairs;
}

// Names of planes in a row that have slipped by one.
std::size_t Mapper::test_shifts(const RefineResult& refined, const RefineOptions& options,
                                const std::function<bool(const RefineProgress&)>& progress) {
  DoubleOptions doubles;
  doubles.association = options_.association;
  const auto reconsidered =
      test_shifted_associations(graph_, find_shifted_associations(graph_, outlines_, doubles),
                                doubles.gate, refined, options, progress);
  if (!reconsidered) return 0;
  share_outlines(reconsidered->into, reconsidered->beside);
  join_planes(reconsidered->from, reconsidered->into);
  return 1;
}

// Planes that are seen through each other.
std::size_t Mapper::test_merges(const RefineResult& refined, const RefineOptions& options,
                                const PlanePairs& apart,
                                const std::function<bool(const RefineProgress&)>& progress) {
  DoubleOptions doubles;
  doubles.association = options_.association;
  const auto pairs = test_merge_hypotheses(
      graph_, find_seen_through(graph_, outlines_, apart, doubles), refined, options, progress);
  for (const auto& [from, into] : pairs) join_planes(from, into);
  return pairs.size();
}

// In the window, where it is there, and in the graph.
void Mapper::join_planes(PlaneId from, PlaneId into) {
  if (window_.contains(from)) {
    if (window_.contains(into)) {
      window_.merge_planes(from, into);
    } else {
      window_.rename_plane(from, into);
      window_.set_anchor(into, graph_.at(into).anchor_map);
    }
  }
  absorb(from, into);
}

// A merge is wrong when the refiner, all in one, believes less than half of what one side saw.
std::size_t Mapper::undo_contradicted(const std::vector<std::pair<PlaneId, PlaneId>>& merged,
                                      PlanePairs& apart) {
  std::size_t undone = 0;
  for (auto pair = merged.rbegin(); pair != merged.rend(); ++pair) {
    const auto record = merges_.find(pair->first);
    if (record == merges_.end()) continue;
    const PlaneId successor = successor_of(graph_, pair->first);
    std::size_t accepted = 0, rejected = 0;
    for (const auto& f : graph_.plane_moments) {
      if (f.plane != successor) continue;
      const bool of_it = std::any_of(record->second.factors.begin(), record->second.factors.end(),
                                     [&f](const PlaneMomentsFactor& g) { return same_view(f, g); });
      if (of_it) ++(f.weight < 0.5 ? rejected : accepted);
    }
    if (rejected <= accepted) continue;
    // One view that fitted and no longer does is mistaken, not the only one of another surface.
    if (accepted + rejected == 1) continue;
    apart.insert({pair->first, successor});
    undo_merge(pair->first);
    ++undone;
  }
  return undone;
}

// Planes of which the refiner believed no frame: their views were of something else.
std::size_t Mapper::drop_unsupported() {
  std::set<PlaneId> supported;
  for (const auto& f : graph_.plane_moments) {
    if (f.weight >= 0.5) supported.insert(f.plane);
  }
  std::size_t gone = 0;
  for (auto& plane : graph_.planes) {
    if (!plane.active || supported.count(plane.id) || window_.contains(plane.id)) continue;
    plane.active = false;
    index_.remove(plane.id);
    ++gone;
  }
  return gone;
}

bool Mapper::undo_merge(PlaneId from) {
  const auto it = merges_.find(from);
  if (it == merges_.end()) return false;
  const PlaneId into = successor_of(graph_, from);
  const MergeRecord record = it->second;
  merges_.erase(it);
  PlaneLandmark& plane = graph_.at(from);
  plane = record.landmark;
  plane.active = true;
  plane.merged_into = PlaneId::kNone;
  for (auto& f : graph_.plane_moments) {
    if (f.plane != into) continue;
    const bool of_it = std::any_of(record.factors.begin(), record.factors.end(),
                                   [&f](const PlaneMomentsFactor& g) { return same_view(f, g); });
    if (!of_it) continue;
    f.plane = from;
    f.weight = 1;
  }
  for (const MarginalPrior& prior : record.priors) graph_.marginal_priors.push_back(prior);
  outlines_[from] = record.outlines;
  remake_outline(plane, record.outlines, graph_, options_.outline_cell_m);
  if (PlaneLandmark* other = graph_.find(into)) {
    auto& pieces = outlines_[into];
    std::erase_if(pieces, [&](const OutlinePiece& p) {
      return std::any_of(record.outlines.begin(), record.outlines.end(), [&](const auto& q) {
        return p.keyframe == q.keyframe && p.points_body == q.points_body;
      });
    });
    remake_outline(*other, pieces, graph_, options_.outline_cell_m);
    other->observations = std::max<std::int64_t>(0, other->observations - plane.observations);
  }
  index_.clear();
  for (const auto& p : graph_.planes) {
    if (!p.active) continue;
    for (const auto& outline : outlines_map(p)) {
      index_.insert_outline(p.id, outline);
    }
  }
  return true;
}

}  // namespace lamina
