// Evidence changes hands; what it was before is kept.
#include <lamina/backend/mapper/plane_merging.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/backend/association/level_separation.hpp>
#include <lamina/backend/association/outline_gap.hpp>
#include <lamina/backend/mapper/plane_information.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

// Of a plane's (tilt, tilt, rho) about `middle`, in its own tangent basis; `C` is about its anchor.
Eigen::Matrix3d covariance_about(const PlaneLandmark& plane, const Eigen::Matrix3d& C,
                                 const Eigen::Vector3d& middle) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d arm = middle - plane.anchor_map;
  J.bottomLeftCorner<1, 2>() = -arm.transpose() * plane.plane_anchor.tangent_basis();
  return J * C * J.transpose();
}

// Whether two planes are next to each other and agree about `middle`, their covariances being C_a
// and C_b.
bool one_surface(const PlaneLandmark& a, const Eigen::Matrix3d& C_a, const PlaneLandmark& b,
                 const Eigen::Matrix3d& C_b, const Eigen::Vector3d& middle,
                 const AssociationOptions& options) {
  if (angle_between(a.plane_anchor, b.plane_anchor) > options.max_angle_deg * kDegree / 4) {
    return false;
  }
  const Eigen::Vector3d off = a.plane_map().about(middle).boxminus(b.plane_map().about(middle));
  const double surface = options.surface_sigma_m;
  const double tilt = options.surface_sigma_deg * kDegree;
  Eigen::Matrix3d C = covariance_about(a, C_a, middle) + covariance_about(b, C_b, middle);
  C.diagonal() += Eigen::Vector3d(tilt * tilt, tilt * tilt, surface * surface);
  // However unsure, planes this far apart are not made one: a slab lies on its floor.
  return !(std::abs(off.z()) > 5 * surface) && !(off.dot(C.llt().solve(off)) > 7.8) &&
         beside(seen_points_map(a), seen_points_map(b), options.max_gap_m);
}

// Of two factors of one keyframe on one plane the later one goes; the other, or null.
PlaneMomentsFactor* drop_double(std::vector<PlaneMomentsFactor>& factors, KeyframeId keyframe,
                                PlaneId plane) {
  const auto same = [&](const PlaneMomentsFactor& f) {
    return f.keyframe == keyframe && f.plane == plane;
  };
  const auto last = std::find_if(factors.rbegin(), factors.rend(), same);
  if (last != factors.rend()) factors.erase(std::next(last).base());
  const auto rest = std::find_if(factors.rbegin(), factors.rend(), same);
  return rest == factors.rend() ? nullptr : &*rest;
}

KeyframeId oldest(const std::vector<KeyframeId>& keyframes) {
  return *std::min_element(keyframes.begin(), keyframes.end());
}

// Planes near what was seen.
std::vector<PlaneId> near(const PlaneIndex& index, const PlaneEvidence& seen,
                          const SE3& T_map_body) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : seen.outline_body) points.push_back(T_map_body * p);
  return seen.partial ? index.near(sample_outline(points, index.cell()))
                      : index.near_close(sample_outline(points, index.small_cell()));
}

// Whether a factor is of one of these views, whatever plane it is of now.
bool among(const std::vector<PlaneMomentsFactor>& views, const PlaneMomentsFactor& f) {
  return std::any_of(views.begin(), views.end(), [&f](const PlaneMomentsFactor& g) {
    return f.keyframe == g.keyframe && f.moments_body.mean() == g.moments_body.mean();
  });
}

MergeRecord record_of(const WorkingMap& map, PlaneId from) {
  MergeRecord record;
  record.landmark = map.graph.at(from);
  for (const auto& f : map.graph.plane_moments) {
    if (f.plane == from) record.factors.push_back(f);
  }
  const auto pieces = map.outlines.find(from);
  if (pieces != map.outlines.end()) record.outlines = pieces->second;
  // Its cells are drawn anew should it come back.
  record.landmark.outline = OutlineGrid(map.options.outline_cell_m);
  return record;
}

// Whether segments alone, of two points each, saw a plane.
bool seen_by_lines(const std::vector<OutlinePiece>& pieces) {
  return !pieces.empty() && std::all_of(pieces.begin(), pieces.end(), [](const auto& piece) {
    return piece.points_body.size() <= 2;
  });
}

// What the present keyframe saw of `from` is of `into`.
void join_gathered(WorkingMap& map, PlaneId from, PlaneId into) {
  const auto gathered = map.gathered.find(from);
  if (gathered == map.gathered.end()) return;
  const PlaneViews views = gathered->second;
  map.gathered.erase(gathered);
  const auto [there, first] = map.gathered.try_emplace(into, views);
  if (first) return;
  // The graph has a factor of each now: one goes, the other takes both.
  there->second.join(views);
  PlaneMomentsFactor* rest = drop_double(map.graph.plane_moments, map.keyframe, into);
  if (!rest) return;
  const double weight = rest->weight;
  *rest = factor_of(map.keyframe, into, there->second, map.options.association);
  rest->weight = weight;
  map.window.set(*rest);
}

}  // namespace

void PlaneMerging::join(WorkingMap& map, PlaneId from, PlaneId into) {
  if (map.window.contains(from)) {
    if (map.window.contains(into)) {
      map.window.merge_planes(from, into);
    } else {
      map.window.rename_plane(from, into);
      map.window.set_anchor(into, map.graph.at(into).anchor_map);
    }
  }
  absorb(map, from, into);
}

void PlaneMerging::absorb(WorkingMap& map, PlaneId from, PlaneId into) {
  MergeRecord& record = merges_[from] = record_of(map, from);
  map.graph.merge_planes(from, into);
  map.graph.at(from).outline = OutlineGrid(map.options.outline_cell_m);
  // The weak prior of the plane that went is about an anchor that is no more.
  std::erase_if(map.graph.marginal_priors, [&record, from](const MarginalPrior& p) {
    const bool of_it = std::find(p.planes.begin(), p.planes.end(), from) != p.planes.end();
    if (of_it) record.priors.push_back(p);
    return of_it;
  });
  map.index.rename(from, into);
  auto& pieces = map.outlines[into];
  pieces.insert(pieces.end(), record.outlines.begin(), record.outlines.end());
  map.outlines.erase(from);
  join_gathered(map, from, into);
  if (!map.partial.count(from)) map.partial.erase(into);
  map.partial.erase(from);
  map.joint.erase(from);
  if (from == map.first_floor) {
    map.first_floor = PlaneId::kNone;
    map.hold_first_floor(into);
  }
}

std::vector<std::pair<PlaneId, PlaneId>> PlaneMerging::merge_coplanar(WorkingMap& map) {
  std::vector<std::pair<PlaneId, PlaneId>> merged;
  std::optional<LevelGaps> gaps;
  // Only planes seen by this keyframe can have come near another one just now.
  std::vector<PlaneId> fresh;
  for (const auto& [id, views] : map.gathered) fresh.push_back(id);
  for (const PlaneId a : fresh) {
    const PlaneLandmark* plane_a = map.graph.find(a);
    if (!plane_a || !plane_a->active || !map.joint.count(a)) continue;
    // Compared where the one was seen just now: the other's covariance says what that is worth.
    const PlaneEvidence& seen = map.gathered.at(a).best();
    const SE3& T = map.T_map_keyframe();
    const Eigen::Vector3d middle = T * seen.moments_body.mean();
    const std::vector<PlaneId> near_a = near(map.index, seen, T);
    const auto covariance = [&map](PlaneId id) -> Eigen::Matrix3d {
      return map.joint.at(id).bottomRightCorner<3, 3>();
    };
    for (const PlaneId b : map.window.planes()) {
      const PlaneLandmark& plane_b = map.graph.at(b);
      if (b == a || !plane_b.active || !map.joint.count(b)) continue;
      if (!std::binary_search(near_a.begin(), near_a.end(), b)) continue;
      if (!one_surface(*plane_a, covariance(a), plane_b, covariance(b), middle,
                       map.options.association)) {
        continue;
      }
      // Two platforms, or one and its floor.
      if (!gaps)
        gaps.emplace(map.graph, map.outlines, map.options.association,
                     oldest(map.window.keyframes()));
      if (gaps->apart(a, b)) continue;
      const PlaneId from = std::max(a, b), into = std::min(a, b);
      map.window.merge_planes(from, into);
      absorb(map, from, into);
      merged.emplace_back(from, into);
      break;
    }
  }
  return merged;
}

bool PlaneMerging::undo(WorkingMap& map, PlaneId from) {
  const auto it = merges_.find(from);
  if (it == merges_.end()) return false;
  const PlaneId into = successor_of(map.graph, from);
  const MergeRecord record = it->second;
  merges_.erase(it);
  PlaneLandmark& plane = map.graph.at(from);
  plane = record.landmark;
  plane.active = true;
  plane.merged_into = PlaneId::kNone;
  for (auto& f : map.graph.plane_moments) {
    if (f.plane != into || !among(record.factors, f)) continue;
    f.plane = from;
    f.weight = 1;
  }
  for (const MarginalPrior& prior : record.priors) map.graph.marginal_priors.push_back(prior);
  map.outlines[from] = record.outlines;
  if (seen_by_lines(record.outlines)) map.partial.insert(from);
  remake_outline(plane, record.outlines, map.graph, map.options.outline_cell_m);
  if (PlaneLandmark* other = map.graph.find(into)) {
    auto& pieces = map.outlines[into];
    std::erase_if(pieces, [&](const OutlinePiece& p) {
      return std::any_of(record.outlines.begin(), record.outlines.end(), [&](const auto& q) {
        return p.keyframe == q.keyframe && p.points_body == q.points_body;
      });
    });
    if (seen_by_lines(pieces)) map.partial.insert(into);
    remake_outline(*other, pieces, map.graph, map.options.outline_cell_m);
    other->observations = std::max<std::int64_t>(0, other->observations - plane.observations);
  }
  map.index.clear();
  for (const auto& p : map.graph.planes) {
    if (!p.active) continue;
    for (const auto& outline : outlines_map(p)) map.index.insert_outline(p.id, outline);
  }
  return true;
}

std::size_t PlaneMerging::undo_contradicted(WorkingMap& map,
                                            const std::vector<std::pair<PlaneId, PlaneId>>& merged,
                                            PlanePairs& apart) {
  std::size_t undone = 0;
  for (auto pair = merged.rbegin(); pair != merged.rend(); ++pair) {
    const auto record = merges_.find(pair->first);
    if (record == merges_.end()) continue;
    const PlaneId successor = successor_of(map.graph, pair->first);
    std::size_t accepted = 0, rejected = 0;
    for (const auto& f : map.graph.plane_moments) {
      if (f.plane != successor) continue;
      if (among(record->second.factors, f)) ++(f.weight < 0.5 ? rejected : accepted);
    }
    if (rejected <= accepted) continue;
    // One view that fitted and no longer does is mistaken, not the only one of another surface.
    if (accepted + rejected == 1) continue;
    apart.insert({pair->first, successor});
    undo(map, pair->first);
    ++undone;
  }
  return undone;
}

void PlaneMerging::refined() {
  std::erase_if(merges_, [](const auto& merge) { return merge.second.stood; });
  for (auto& [id, record] : merges_) record.stood = true;
}

void PlaneMerging::move(const SE3& T_new_map) {
  for (auto& [id, record] : merges_) {
    Graph one;
    one.planes.push_back(record.landmark);
    one.marginal_priors = record.priors;
    one.move(T_new_map);
    record.landmark = one.planes.front();
    record.priors = one.marginal_priors;
  }
}

}  // namespace lamina
