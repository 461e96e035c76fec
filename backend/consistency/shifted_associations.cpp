// Rows of three planes from pairs that keyframes tell apart; trials on copies of the graph.
#include <lamina/backend/consistency/shifted_associations.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include <lamina/backend/association/plane_neighbourhood.hpp>
#include <lamina/backend/association/same_view_separation.hpp>
#include <lamina/backend/consistency/hypothesis_test.hpp>
#include <lamina/backend/refine/graduated_non_convexity.hpp>
#include <lamina/backend/solver/rotation_initialization.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kMostOff = 0.3;  // m: one wall stands no further apart
constexpr double kCovered = 0.6;  // of what was seen of one lies over the other
constexpr double kMissed = 0.5;   // of the images that show where a plane is miss it, at most
constexpr std::size_t kMostTrials = 8;

/// A plane that stands before (`offset` > 0) or behind another, seen together with it.
struct Beside {
  PlaneId id;
  SameViewSeparation::Offset offset;
};

/// Share of what a keyframe saw that lies over `other`.
double share_over(const OutlinePiece& piece, const Graph& graph, const PlaneLandmark& other) {
  const Keyframe* keyframe = graph.find(piece.keyframe);
  if (!keyframe) return 0;
  const SE3 T_outline_body = other.T_map_outline.inverse() * keyframe->T_map_body;
  const auto points = sample_outline(piece.points_body, other.outline.cell_size());
  const auto inside = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
    return other.outline.contains((T_outline_body * p).head<2>());
  });
  return points.empty() ? 0 : static_cast<double>(inside) / static_cast<double>(points.size());
}

/// How many of `keyframes` saw most of their piece of a plane over `other`.
std::size_t count_over(const std::vector<OutlinePiece>& pieces,
                       const std::set<KeyframeId>& keyframes, const Graph& graph,
                       const PlaneLandmark& other) {
  std::set<KeyframeId> found;
  for (const OutlinePiece& piece : pieces) {
    if (keyframes.count(piece.keyframe) && share_over(piece, graph, other) >= kCovered) {
      found.insert(piece.keyframe);
    }
  }
  return found.size();
}

/// Keyframes between this one and the nearest of a set.
std::int64_t steps_to(const std::set<KeyframeId>& keyframes, KeyframeId id) {
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  for (const KeyframeId other : keyframes) {
    least =
        std::min(least, std::abs(static_cast<std::int64_t>(other) - static_cast<std::int64_t>(id)));
  }
  return least;
}

/// The views of `into` that may be of the plane beside it: those seen with `from`; and, where some
/// see neither, with those nearer to them than to those seen with the plane beside it.
std::vector<std::vector<std::size_t>> shifted_views(const Graph& graph, PlaneId into,
                                                    const std::set<KeyframeId>& see_from,
                                                    const std::set<KeyframeId>& see_beside) {
  std::vector<std::size_t> together, nearer;
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    const PlaneMomentsFactor& f = graph.plane_moments[i];
    if (f.plane != into) continue;
    if (see_from.count(f.keyframe)) together.push_back(i);
    if (steps_to(see_from, f.keyframe) < steps_to(see_beside, f.keyframe)) nearer.push_back(i);
  }
  if (together == nearer) return {together};
  return {together, nearer};
}

/// The graph with the row's names put right, and the views of the planes concerned.
struct Trial {
  Graph graph;
  std::vector<std::size_t> concerned, renamed;

  Trial(const Graph& original, const ShiftedAssociations& row) : graph(original) {
    for (const std::size_t i : row.views) {
      graph.plane_moments[i].plane = row.beside;
      graph.plane_moments[i].weight = 1;
    }
    renamed = row.views;
    for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
      PlaneMomentsFactor& f = graph.plane_moments[i];
      if (f.plane == row.from) {
        f.plane = row.into;
        if (f.weight >= 0.5) renamed.push_back(i);
      }
      if (f.weight >= 0.5 && (f.plane == row.into || f.plane == row.beside)) {
        concerned.push_back(i);
      }
    }
    for (SegmentFactor& f : graph.segments) {
      if (f.plane == row.from) f.plane = row.into;
    }
    graph.at(row.from).active = false;
    std::erase_if(graph.marginal_priors, [&row](const MarginalPrior& prior) {
      return std::find(prior.planes.begin(), prior.planes.end(), row.from) != prior.planes.end();
    });
  }
};

// What stands beside each plane, and how far.
std::map<PlaneId, std::vector<Beside>> planes_beside(const PlaneNeighbourhood& near,
                                                     const SameViewSeparation& views,
                                                     double max_angle) {
  std::map<PlaneId, std::vector<Beside>> row;
  for (const auto& [a, b] : near.pairs(max_angle)) {
    for (const auto& [id, other] : {std::pair(a, b), std::pair(b, a)}) {
      const auto offset = views.offset(other, id);
      if (offset && std::abs(offset->mean) <= kMostOff) row[id].push_back({other, *offset});
    }
  }
  return row;
}

struct SeenPieces {
  const Graph& graph;
  const std::map<PlaneId, std::vector<OutlinePiece>>& outlines;

  std::size_t over(PlaneId id, const std::set<KeyframeId>& keyframes,
                   const PlaneLandmark& other) const {
    const auto pieces = outlines.find(id);
    return pieces == outlines.end() ? 0 : count_over(pieces->second, keyframes, graph, other);
  }
  // What is seen of a plane grows: the little that one pair showed lies within what the other did.
  bool within(PlaneId id, const std::set<KeyframeId>& keyframes, PlaneId other,
              const std::set<KeyframeId>& others) const {
    const auto pieces = outlines.find(other);
    if (pieces == outlines.end()) return false;
    std::vector<OutlinePiece> kept;
    std::copy_if(pieces->second.begin(), pieces->second.end(), std::back_inserter(kept),
                 [&](const OutlinePiece& piece) { return others.count(piece.keyframe) > 0; });
    PlaneLandmark seen = graph.at(other);
    remake_outline(seen, kept, graph, seen.outline.cell_size());
    return outlines.count(id) > 0 && 2 * over(id, keyframes, seen) > keyframes.size();
  }
};

}  // namespace

std::vector<ShiftedAssociations> find_shifted_associations(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const DoubleOptions& options) {
  const PlaneNeighbourhood near(graph, outlines, options.association.max_gap_m, false);
  // Names that slipped are what views were rejected for: those have a say.
  const SameViewSeparation views(graph, options.association, options.gate, 0);
  const SeenPieces pieces{graph, outlines};
  std::vector<ShiftedAssociations> found;
  for (const auto& [into, sides] :
       planes_beside(near, views, options.association.max_angle_deg * kDegree)) {
    for (const Beside& from : sides) {
      for (const Beside& beside : sides) {
        const double sum = from.offset.mean + beside.offset.mean;
        const double variance = from.offset.variance + beside.offset.variance;
        if (from.offset.mean * beside.offset.mean > 0 || sum * sum > options.gate * variance) {
          continue;
        }
        const std::set<KeyframeId>& see_from = from.offset.seen_by;
        const std::set<KeyframeId>& see_beside = beside.offset.seen_by;
        const std::size_t in_place = pieces.over(into, see_from, graph.at(beside.id));
        if (2 * in_place <= see_from.size() &&
            !pieces.within(beside.id, see_beside, into, see_from)) {
          continue;
        }
        if (2 * pieces.over(from.id, see_from, graph.at(into)) <= see_from.size()) continue;
        const std::size_t missed = in_place + pieces.over(into, see_beside, graph.at(from.id));
        for (auto& renamed : shifted_views(graph, into, see_from, see_beside)) {
          found.push_back({from.id, into, beside.id, missed, std::move(renamed)});
        }
      }
    }
  }
  return found;
}

std::optional<ShiftedAssociations> test_shifted_associations(
    Graph& graph, const std::vector<ShiftedAssociations>& rows, double gate,
    const RefineResult& refined, const RefineOptions& options,
    const std::function<bool(const RefineProgress&)>& progress) {
  const double limit = options.inlier_chi2;
  const double before = truncated_cost(refined, limit);
  double best_cost = std::numeric_limits<double>::infinity();
  std::optional<Trial> best;
  std::optional<ShiftedAssociations> reconsidered;
  for (std::size_t k = 0; k < std::min(rows.size(), kMostTrials); ++k) {
    Trial trial(graph, rows[k]);
    RefineOptions pinned = options;
    pinned.refined_before = true;
    pinned.thorough = false;
    pinned.pinned_views = trial.concerned;
    const RefineResult result = refine(trial.graph, pinned, progress);
    if (stopped(result.status)) return std::nullopt;
    const double cost = truncated_cost(result, limit);
    const double missing = 2 * std::log(1 / kMissed) * static_cast<double>(rows[k].missed);
    if (!(cost < std::min(best_cost, before + gate + missing)) ||
        !most_pinned(trial.graph, trial.renamed))
      continue;
    best_cost = cost;
    best.emplace(std::move(trial));
    reconsidered = rows[k];
  }
  if (!best) return std::nullopt;
  put_back(states_of(best->graph), graph);
  take_weights(best->graph, graph);
  for (const std::size_t i : reconsidered->views)
    graph.plane_moments[i].plane = reconsidered->beside;
  return reconsidered;
}

}  // namespace lamina
